#include "daemon/live_shows.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/lock.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestPicture = 64u << 20;
constexpr std::size_t kLargestFigures = 1u << 20;
constexpr std::size_t kLogEnd = 600;
constexpr std::chrono::seconds kBetweenTouches{1};

}  // namespace

bool LiveShows::is_live(const fs::path& directory) const {
  const Result<bool> held = FileLock::is_held(directory / "lock");
  return held && *held;
}

bool LiveShows::is_started(const fs::path& directory) {
  const auto child = started_.find(directory);
  return child != started_.end() && !child->second->poll_exit();
}

nlohmann::json LiveShows::figures_of(const fs::path& directory) const {
  const auto text = read_text(directory / "view.json", kLargestFigures);
  auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  return json.is_object() ? json : nlohmann::json::object();
}

// Looking keeps a program running; one that was told to end stays told.
void LiveShows::touch(const fs::path& directory) {
  const fs::path file = directory / "watched";
  const auto now = std::chrono::steady_clock::now();
  const auto [last, is_first] = touched_.try_emplace(file, now);
  if (!is_first && now - last->second < kBetweenTouches) return;
  last->second = now;
  std::error_code none;
  fs::last_write_time(file, fs::file_time_type::clock::now(), none);
}

std::string LiveShows::log_of(const fs::path& directory) const {
  const auto text = read_text(directory / "job.log", kLargestFigures);
  if (!text) return {};
  return text->substr(text->size() - std::min(text->size(), kLogEnd));
}

Result<void> LiveShows::start_in(const fs::path& directory, JobCommand command) {
  if (auto made = files_.make_directories(directory); !made) return made;
  std::error_code none;
  for (const char* old : {"view.png", "view.json", "job.log"}) fs::remove(directory / old, none);
  if (auto watched = write_whole(files_, directory / "watched", std::string_view()); !watched)
    return watched;
  auto child = executor_.start(command);
  if (!child) return child.error();
  started_[directory] = *std::move(child);
  return ok();
}

Result<nlohmann::json> LiveShows::look(const std::string& name) {
  const Result<fs::path> directory = directory_of(name);
  if (!directory) return directory.error();
  std::error_code none;
  if (!fs::exists(*directory, none)) return nothing_shown(name);
  touch(*directory);
  nlohmann::json json = figures_of(*directory);
  json[key()] = name;
  if (!json.contains("message")) json["message"] = "";
  const auto child = started_.find(*directory);
  const auto exit = child == started_.end() ? std::optional<int>(0) : child->second->poll_exit();
  if (is_live(*directory)) {
    json["state"] = json.contains("frame") ? "running" : "starting";
  } else if (!exit) {
    json["state"] = "starting";
  } else {
    json["state"] = *exit == 0 ? "over" : "failed";
    if (*exit != 0) json["message"] = log_of(*directory);
  }
  return json;
}

Result<std::string> LiveShows::picture(const std::string& name) {
  const Result<fs::path> directory = directory_of(name);
  if (!directory) return directory.error();
  touch(*directory);
  auto png = read_text(*directory / "view.png", kLargestPicture);
  if (!png) return nothing_shown(name);
  return png;
}

fs::file_time_type LiveShows::changed(const std::string& name) {
  const Result<fs::path> directory = directory_of(name);
  if (!directory) return {};
  touch(*directory);
  std::error_code error;
  const auto time = fs::last_write_time(*directory / "view.json", error);
  return error ? fs::file_time_type() : time;
}

}  // namespace opaline::daemon
