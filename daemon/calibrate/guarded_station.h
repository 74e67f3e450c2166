#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "base/events.h"
#include "base/result.h"
#include "capture/station.h"
#include "config/rig_config.h"

namespace opaline::daemon {

using WithStation = std::function<Result<void>(const capture::Station&, std::stop_token)>;

/// Opens the devices of a rig file, under a guardian, for what is to be done with them; whoever calls holds the station's lock. `directory`
/// becomes a session's, in which the devices' helpers find the rig's configuration. The token that `work` gets is also stopped when the
/// guardian dies. Errors: what the devices, the guardian or `work` return.
Result<void> with_station(const std::filesystem::path& rig_file,
                          const config::RigConfig& rig,
                          const std::filesystem::path& directory,
                          EventSink& events,
                          const std::stop_token& asked,
                          const WithStation& work);

}  // namespace opaline::daemon
