#include "daemon/jobs/station_lock.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <string>

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

fs::path lock_directory() {
  if (const char* named = std::getenv("OPALINE_LOCK_DIR"); named != nullptr && *named != '\0') {
    return named;
  }
  return ::access("/run/lock", W_OK | X_OK) == 0 ? "/run/lock" : "/tmp";
}

// Two names that differ only in odd characters share a lock, which is safe.
std::string file_name(std::string_view station) {
  std::string name;
  for (const char c : station) {
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  }
  return name;
}

}  // namespace

fs::path station_lock_path(std::string_view station) {
  return lock_directory() / fmt::format("opaline-station-{}.lock", file_name(station));
}

Result<FileLock> lock_station(std::string_view station) {
  if (station.empty()) return invalid_argument("a station needs a name");
  Result<FileLock> lock = FileLock::acquire(station_lock_path(station));
  if (!lock && lock.error().code == ErrorCode::kBusy) {
    return busy(fmt::format(
        "station \"{}\" is in use by another session, calibration or viewfinder", station));
  }
  return lock;
}

}  // namespace opaline::daemon
