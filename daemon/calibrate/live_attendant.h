#pragma once

#include <chrono>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

#include "base/files.h"
#include "calibration/attendant.h"
#include "daemon/live_view.h"

namespace opaline::daemon {

/// Shows a calibration to whoever watches the station: its frames, two a second, and the board with its corners in each pose; and
/// listens to what the operator says, at the keyboard (Enter: take this pose; "enough": no more poses) or over HTTP.
/// A picture that cannot be shown is a warning, once, and no more.
class LiveAttendant : public calibration::Attendant {
 public:
  struct Options {
    LiveView* live = nullptr;      ///< perhaps none; outlives us
    std::filesystem::path poses;   ///< directory of a picture of each pose: pose_03.png
    int version = 0;               ///< of the calibration
    bool holds_the_board = false;  ///< somebody does
    double black = 64.0;
    double clipping = 4095.0;
  };
  /// `files` outlives us.
  LiveAttendant(const Options& options, FileOperations& files) : options_(options), files_(files) {}

  bool holds_the_board() const override { return options_.holds_the_board; }
  calibration::PoseAnswer answer() override;
  void saw(const Frame& frame) override;
  void saw(const calibration::PoseSight& sight) override;
  /// What the calibration does now: its step, and more. Thread-safe.
  void doing(const std::string& step, const std::string& detail);

 private:
  bool is_due();
  nlohmann::json figures() const;
  void show(std::span<const std::byte> png, nlohmann::json figures);
  void complain(const Error& error);
  std::string typed();

  Options options_;
  FileOperations& files_;
  mutable std::mutex mutex_;
  std::string step_;    // guarded by mutex_
  std::string detail_;  // guarded by mutex_
  std::optional<std::chrono::steady_clock::time_point> shown_;
  bool waiting_ = false;  // for a pose, in what was shown last
  double best_focus_ = 0.0;
  bool keyboard_ = true;
  bool complained_ = false;
  bool poses_are_old_ = true;  // of an earlier run of the step
};

}  // namespace opaline::daemon
