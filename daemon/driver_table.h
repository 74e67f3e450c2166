#pragma once

#include <filesystem>
#include <memory>
#include <stop_token>

#include "base/clock.h"
#include "base/events.h"
#include "base/result.h"
#include "capture/station.h"
#include "config/rig_config.h"
#include "drivers/camera.h"
#include "drivers/light_stage.h"
#include "drivers/projector.h"
#include "sim/rig_port.h"

namespace opaline::daemon {

/// The devices that a rig file names, closed as yet.
class StationDevices {
 public:
  /// Makes the drivers by their names. A simulated station is built here, or started as opaline-rig (found beside this
  /// program) unless it runs; its light transport may have to be computed, which takes long and reports progress.
  /// `session` is the session's directory.
  static Result<std::unique_ptr<StationDevices>> create(const config::RigConfig& rig,
                                                        const std::filesystem::path& session,
                                                        EventSink& events,
                                                        std::stop_token stop);
  capture::Station station() { return {*camera_, *projector_, *clock_}; }

 private:
  StationDevices() = default;
  std::unique_ptr<Clock> clock_;
  std::unique_ptr<sim::RigPort> rig_;
  std::unique_ptr<drivers::Camera> camera_;
  std::unique_ptr<drivers::LightStage> light_stage_;  // null where the station has a projector
  std::unique_ptr<drivers::Projector> projector_;
};

/// A program that is installed beside this one.
Result<std::filesystem::path> program_beside(const char* name);

}  // namespace opaline::daemon
