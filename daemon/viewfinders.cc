#include "daemon/viewfinders.h"

#include <fmt/format.h>

#include <system_error>

#include "base/lock.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/live_view.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

bool held(const fs::path& lock) {
  const Result<bool> is = FileLock::is_held(lock);
  return is && *is;
}

}  // namespace

Result<fs::path> Viewfinders::directory_of(const std::string& station) const {
  return live_directory(options_.live, station);
}

Error Viewfinders::nothing_shown(const std::string& station) const {
  return not_found(
      fmt::format("station \"{}\" has shown nothing: POST /v1/viewfinders starts a viewfinder, "
                  "\"opaline calibrate\" a calibration",
                  station));
}

Result<void> Viewfinders::refuse_busy(const std::string& station, const fs::path& directory) {
  const fs::path lock = station_lock_path(station);
  const bool starts = is_started(directory);
  if (!starts && !held(lock)) return ok();
  if (starts || is_live(directory)) {
    return busy(fmt::format("station \"{}\" is in use by a {}: GET /v1/viewfinders/{} shows it",
                            station,
                            figures_of(directory).value("by", "viewfinder"),
                            station));
  }
  const std::string session = options_.user_of(lock);
  return busy(session.empty()
                  ? fmt::format("station \"{}\" is in use by another program", station)
                  : fmt::format("station \"{}\" is in use by session {}", station, session));
}

Result<nlohmann::json> Viewfinders::start(const std::string& rig_toml, bool same_user) {
  const Result<std::string> station = options_.station_of(rig_toml, same_user);
  if (!station) return station.error();
  const fs::path directory = live_directory(options_.live, *station);
  if (auto free = refuse_busy(*station, directory); !free) return free.error();
  if (auto made = files_.make_directories(directory); !made) return made.error();
  const fs::path rig = directory / "rig.toml";
  if (auto written = write_whole(files_, rig, rig_toml); !written) return written.error();
  if (auto started = start_in(
          directory,
          {"calibrate",
           directory,
           {"--live", "--while-watched", std::to_string(kWatchedFor.count()), "--", rig.string()}});
      !started)
    return started.error();
  return look(*station);
}

Result<void> Viewfinders::stop(const std::string& station) {
  const Result<nlohmann::json> now = look(station);
  if (!now) return now.error();
  const std::string state = now->value("state", "");
  if (state != "running" && state != "starting")
    return busy(fmt::format("no viewfinder runs on station \"{}\"", station));
  if (now->value("by", "") == "calibration")
    return busy(fmt::format(
        "a calibration has station \"{}\": whoever started it stops it with Ctrl-C", station));
  return files_.remove(live_directory(options_.live, station) / "watched");
}

Result<void> Viewfinders::answer(const std::string& station, const std::string& what) {
  if (what != "take" && what != "enough")
    return invalid_argument(fmt::format("\"answer\": \"{}\"; expected take or enough", what));
  const Result<nlohmann::json> now = look(station);
  if (!now) return now.error();
  if (now->value("state", "") != "running" || now->value("by", "") != "calibration")
    return busy(fmt::format("no calibration runs on station \"{}\"", station));
  return write_whole(
      files_, live_directory(options_.live, station) / "answer", std::string_view(what));
}

}  // namespace opaline::daemon
