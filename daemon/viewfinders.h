#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.h"
#include "base/result.h"
#include "daemon/executor.h"

namespace opaline::daemon {

/// What the stations of this machine see just now: viewfinders, which it starts (opaline-calibrate --live), and calibrations, which
/// operators start; both show their pictures in a live view (daemon/live_view.h), which is read here. A viewfinder ends when it is
/// told to, or when nobody has looked at it for kWatchedFor; so it outlives the daemon by as much.
///
/// Threads: one. Errors of what takes a station: kNotFound where it has shown nothing yet.
class Viewfinders {
 public:
  struct Options {
    std::filesystem::path live;  ///< of all stations
    /// The name of the station of a rig file's text (daemon/session_rules.h).
    std::function<Result<std::string>(const std::string& rig_toml, bool same_user)> station_of;
    /// The session that has the devices behind a lock; empty: none.
    std::function<std::string(const std::filesystem::path& lock)> user_of;
  };
  static constexpr std::chrono::seconds kWatchedFor{60};

  /// `executor` and `files` outlive us.
  Viewfinders(Options options, Executor& executor, FileOperations& files)
      : options_(std::move(options)), executor_(executor), files_(files) {}

  /// Starts one on the station of a rig file, and says what look() says. Errors: kInvalidArgument with every problem of the text; kBusy
  /// while a session, a calibration or another viewfinder has the station, saying which.
  Result<nlohmann::json> start(const std::string& rig_toml, bool same_user);
  /// {"station","state","message"} and, once there is a picture, its figures. States: starting, running, over, failed.
  Result<nlohmann::json> look(const std::string& station);
  /// The newest picture, PNG.
  Result<std::string> picture(const std::string& station);
  /// When the newest figures were written; the epoch before any. Counts as looking.
  std::filesystem::file_time_type changed(const std::string& station);
  /// Asks a viewfinder to end, which it does after the next picture. Errors: kBusy for a calibration, or when none runs.
  Result<void> stop(const std::string& station);
  /// "take" this pose as it is, or "enough" poses, to a calibration. Errors: kInvalidArgument; kBusy when none runs.
  Result<void> answer(const std::string& station, const std::string& what);

 private:
  std::filesystem::path directory_of(const std::string& station) const;
  bool is_live(const std::string& station) const;
  nlohmann::json figures_of(const std::string& station) const;
  void touch(const std::string& station);
  Result<void> refuse_busy(const std::string& station);
  std::string log_of(const std::string& station) const;

  Options options_;
  Executor& executor_;
  FileOperations& files_;
  std::map<std::filesystem::path, std::unique_ptr<JobProcess>> started_;  // by directory name
  std::map<std::filesystem::path, std::chrono::steady_clock::time_point> touched_;
};

}  // namespace opaline::daemon
