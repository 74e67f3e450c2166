#pragma once

#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// The wish that a session be cancelled: the file cancel.requested in its directory, from the wish
/// until the session is resumed. It outlives the daemon that was told and the job that was asked.
Result<void> wish_cancel(FileOperations& files, const SessionDirectory& session);
Result<void> forget_cancel(FileOperations& files, const SessionDirectory& session);
bool is_cancel_wished(const SessionDirectory& session);

}  // namespace opaline::daemon
