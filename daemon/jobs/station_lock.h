#pragma once

#include <filesystem>
#include <string_view>

#include "base/lock.h"
#include "base/result.h"

namespace opaline::daemon {

/// Where the lock of the station (a set of devices) of that name lies: the same file for every
/// user of the machine, in /run/lock, or where that is missing in /tmp; OPALINE_LOCK_DIR names
/// another directory.
std::filesystem::path station_lock_path(std::string_view station);

/// Holds a station's devices against every other job on this machine until the lock is let go.
/// kBusy, naming the station, when another job has it; kInvalidArgument for an empty name.
Result<FileLock> lock_station(std::string_view station);

}  // namespace opaline::daemon
