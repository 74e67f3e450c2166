#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/event_log.h"
#include "base/events.h"
#include "base/files.h"
#include "capture/sequence.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/simulated_station.h"

namespace opaline::support {

/// What the capture believes of a simulated station: the truth, as a perfect calibration finds it.
capture::StationCalibration calibration_of(const sim::RigOptions& options);

/// The tiny station of simulated_station.h as a capture task: 2 x 2 regions, 7 held-out lights.
capture::CaptureTask tiny_task(const sim::RigOptions& options);

/// Keeps the facts it is told.
class RecordingSink : public EventSink {
 public:
  struct Fact {
    std::string type;
    nlohmann::json data;
  };
  void progress(const Progress& progress) override;
  Result<void> fact(std::string_view type, const nlohmann::json& data) override;
  std::vector<Fact> facts() const;
  /// Facts of one type.
  std::vector<nlohmann::json> facts(std::string_view type) const;
  std::vector<Progress> progresses() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Fact> facts_;           // guarded by mutex_
  std::vector<Progress> progresses_;  // guarded by mutex_
};

/// Facts go to a real log, as a job's do.
class LogSink : public NullSink {
 public:
  /// `log` outlives us.
  explicit LogSink(EventLog& log) : log_(log) {}
  Result<void> fact(std::string_view type, const nlohmann::json& data) override;

 private:
  EventLog& log_;
};

/// The tiny station with its devices, on a clock that stands still unless somebody waits.
class TinyStation {
 public:
  explicit TinyStation(const sim::RigOptions& options,
                       std::shared_ptr<const TransportResponses> responses = tiny_responses());
  sim::Rig& rig() { return *rig_; }
  capture::Station station() { return {camera_, projector_, clock_}; }
  ManualClock& clock() { return clock_; }

 private:
  ManualClock clock_;
  std::unique_ptr<sim::Rig> rig_;
  sim::SimCamera camera_;
  sim::SimProjector projector_;
};

/// Every file below a directory with its bytes, by relative path.
std::vector<std::pair<std::string, std::vector<std::byte>>> files_below(
    const std::filesystem::path& directory);

}  // namespace opaline::support
