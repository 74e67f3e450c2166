#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.h"
#include "base/result.h"
#include "daemon/executor.h"

namespace opaline::daemon {

/// Programs that show pictures in a live view (daemon/live_view.h), by name, for whoever serves them. A program that is started
/// here ends when it is told to, or when nobody has looked at it for kWatchedFor; so it outlives the daemon by as much.
///
/// Threads: one. Errors of what takes a name: kNotFound where nothing has been shown yet.
class LiveShows {
 public:
  static constexpr std::chrono::seconds kWatchedFor{60};

  LiveShows(const LiveShows&) = delete;
  LiveShows& operator=(const LiveShows&) = delete;
  virtual ~LiveShows() = default;

  /// What it is called by, "state", "message" and, once there is a picture, its figures. States: starting, running, over, failed.
  Result<nlohmann::json> look(const std::string& name);
  /// The newest picture, PNG.
  Result<std::string> picture(const std::string& name);
  /// When the newest figures were written; the epoch before any. Counts as looking.
  std::filesystem::file_time_type changed(const std::string& name);

 protected:
  /// `executor` and `files` outlive us.
  LiveShows(Executor& executor, FileOperations& files) : executor_(executor), files_(files) {}

  /// Where it shows its pictures. Errors: kNotFound.
  virtual Result<std::filesystem::path> directory_of(const std::string& name) const = 0;
  virtual Error nothing_shown(const std::string& name) const = 0;
  /// The figure that holds the name.
  virtual const char* key() const = 0;

  /// Starts the program that shows pictures in the directory; what it has shown before is gone.
  Result<void> start_in(const std::filesystem::path& directory, JobCommand command);
  /// Whether it was started here and has not ended.
  bool is_started(const std::filesystem::path& directory);
  bool is_live(const std::filesystem::path& directory) const;
  nlohmann::json figures_of(const std::filesystem::path& directory) const;
  Executor& executor_;
  FileOperations& files_;

 private:
  void touch(const std::filesystem::path& directory);
  std::string log_of(const std::filesystem::path& directory) const;

  std::map<std::filesystem::path, std::unique_ptr<JobProcess>> started_;  // by directory
  std::map<std::filesystem::path, std::chrono::steady_clock::time_point> touched_;
};

}  // namespace opaline::daemon
