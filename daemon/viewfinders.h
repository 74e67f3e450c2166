#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.h"
#include "base/result.h"
#include "daemon/live_shows.h"

namespace opaline::daemon {

/// What the stations of this machine see just now: viewfinders, which it starts (opaline-calibrate --live), and calibrations, which
/// operators start.
///
/// Threads: one. Errors of what takes a station: kNotFound where it has shown nothing yet.
class Viewfinders : public LiveShows {
 public:
  struct Options {
    std::filesystem::path live;  ///< of all stations
    /// The name of the station of a rig file's text (daemon/session_rules.h).
    std::function<Result<std::string>(const std::string& rig_toml, bool same_user)> station_of;
    /// The session that has the devices behind a lock; empty: none.
    std::function<std::string(const std::filesystem::path& lock)> user_of;
  };

  /// `executor` and `files` outlive us.
  Viewfinders(Options options, Executor& executor, FileOperations& files)
      : LiveShows(executor, files), options_(std::move(options)) {}

  /// Starts one on the station of a rig file, and says what look() says. Errors: kInvalidArgument with every problem of the text; kBusy
  /// while a session, a calibration or another viewfinder has the station, saying which.
  Result<nlohmann::json> start(const std::string& rig_toml, bool same_user);
  /// Asks a viewfinder to end, which it does after the next picture. Errors: kBusy for a calibration, or when none runs.
  Result<void> stop(const std::string& station);
  /// "take" this pose as it is, or "enough" poses, to a calibration. Errors: kInvalidArgument; kBusy when none runs.
  Result<void> answer(const std::string& station, const std::string& what);

 private:
  Result<std::filesystem::path> directory_of(const std::string& station) const override;
  Error nothing_shown(const std::string& station) const override;
  const char* key() const override { return "station"; }
  Result<void> refuse_busy(const std::string& station, const std::filesystem::path& directory);

  Options options_;
};

}  // namespace opaline::daemon
