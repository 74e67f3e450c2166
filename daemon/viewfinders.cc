#include "daemon/viewfinders.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "base/lock.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/live_view.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestPicture = 64u << 20;
constexpr std::size_t kLargestFigures = 1u << 20;
constexpr std::size_t kLogEnd = 600;
constexpr std::chrono::seconds kBetweenTouches{1};

bool held(const fs::path& lock) {
  const Result<bool> is = FileLock::is_held(lock);
  return is && *is;
}

Error nothing_shown(const std::string& station) {
  return not_found(
      fmt::format("station \"{}\" has shown nothing: POST /v1/viewfinders starts a viewfinder, "
                  "\"opaline calibrate\" a calibration",
                  station));
}

}  // namespace

fs::path Viewfinders::directory_of(const std::string& station) const {
  return live_directory(options_.live, station);
}

bool Viewfinders::is_live(const std::string& station) const {
  return held(directory_of(station) / "lock");
}

nlohmann::json Viewfinders::figures_of(const std::string& station) const {
  const auto text = read_text(directory_of(station) / "view.json", kLargestFigures);
  auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  return json.is_object() ? json : nlohmann::json::object();
}

// Looking keeps a viewfinder running; one that was told to end stays told.
void Viewfinders::touch(const std::string& station) {
  const fs::path file = directory_of(station) / "watched";
  const auto now = std::chrono::steady_clock::now();
  const auto [last, is_first] = touched_.try_emplace(file, now);
  if (!is_first && now - last->second < kBetweenTouches) return;
  last->second = now;
  std::error_code none;
  fs::last_write_time(file, fs::file_time_type::clock::now(), none);
}

std::string Viewfinders::log_of(const std::string& station) const {
  const auto text = read_text(directory_of(station) / "job.log", kLargestFigures);
  if (!text) return {};
  return text->substr(text->size() - std::min(text->size(), kLogEnd));
}

Result<void> Viewfinders::refuse_busy(const std::string& station) {
  const fs::path lock = station_lock_path(station);
  const auto child = started_.find(directory_of(station).filename());
  const bool starts = child != started_.end() && !child->second->poll_exit();
  if (!starts && !held(lock)) return ok();
  if (starts || is_live(station)) {
    return busy(fmt::format("station \"{}\" is in use by a {}: GET /v1/viewfinders/{} shows it",
                            station,
                            figures_of(station).value("by", "viewfinder"),
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
  if (auto free = refuse_busy(*station); !free) return free.error();
  const fs::path directory = directory_of(*station);
  if (auto made = files_.make_directories(directory); !made) return made.error();
  std::error_code none;
  for (const char* old : {"view.png", "view.json", "job.log"}) fs::remove(directory / old, none);
  const fs::path rig = directory / "rig.toml";
  if (auto written = write_whole(files_, rig, rig_toml); !written) return written.error();
  if (auto watched = write_whole(files_, directory / "watched", std::string_view()); !watched)
    return watched.error();
  auto child = executor_.start(
      {"calibrate",
       directory,
       {"--live", "--while-watched", std::to_string(kWatchedFor.count()), "--", rig.string()}});
  if (!child) return child.error();
  started_[directory.filename()] = *std::move(child);
  return look(*station);
}

Result<nlohmann::json> Viewfinders::look(const std::string& station) {
  std::error_code none;
  if (!fs::exists(directory_of(station), none)) return nothing_shown(station);
  touch(station);
  nlohmann::json json = figures_of(station);
  json["station"] = station;
  json["message"] = "";
  const auto child = started_.find(directory_of(station).filename());
  const auto exit = child == started_.end() ? std::optional<int>(0) : child->second->poll_exit();
  if (is_live(station)) {
    json["state"] = json.contains("frame") ? "running" : "starting";
  } else if (!exit) {
    json["state"] = "starting";
  } else {
    json["state"] = *exit == 0 ? "over" : "failed";
    if (*exit != 0) json["message"] = log_of(station);
  }
  return json;
}

Result<std::string> Viewfinders::picture(const std::string& station) {
  touch(station);
  auto png = read_text(directory_of(station) / "view.png", kLargestPicture);
  if (!png) return nothing_shown(station);
  return png;
}

fs::file_time_type Viewfinders::changed(const std::string& station) {
  touch(station);
  std::error_code error;
  const auto time = fs::last_write_time(directory_of(station) / "view.json", error);
  return error ? fs::file_time_type() : time;
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
  return files_.remove(directory_of(station) / "watched");
}

Result<void> Viewfinders::answer(const std::string& station, const std::string& what) {
  if (what != "take" && what != "enough")
    return invalid_argument(fmt::format("\"answer\": \"{}\"; expected take or enough", what));
  const Result<nlohmann::json> now = look(station);
  if (!now) return now.error();
  if (now->value("state", "") != "running" || now->value("by", "") != "calibration")
    return busy(fmt::format("no calibration runs on station \"{}\"", station));
  return write_whole(files_, directory_of(station) / "answer", std::string_view(what));
}

}  // namespace opaline::daemon
