#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "base/session_directory.h"
#include "daemon/new_session.h"

namespace opaline::daemon {

/// What a session directory is made from: the texts as given, checked, and resolved where they are
/// not. No file is opened but those that a simulated or replayed rig names, and these may be named
/// only by this user's own socket; over TCP they are kInvalidArgument.
/// Errors: kInvalidArgument with every problem of the texts, one a line.
Result<SessionDirectory::Contents> contents_of(const NewSession& wish);

/// The name of the station that a rig file's text names, once all of the text is right. No file that it names may be one of
/// another user's wishes: as contents_of().
Result<std::string> station_of(const std::string& rig_toml, bool same_user);

/// The lock of the station that a session's rig names; empty when its configuration is unreadable.
std::filesystem::path station_lock_of(const SessionDirectory& session);

}  // namespace opaline::daemon
