#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/block.h"
#include "calibration/geometry_options.h"
#include "capture/calibration.h"
#include "config/board_config.h"
#include "config/fields.h"
#include "config/light_stage_config.h"
#include "sim/light_transport.h"
#include "sim/rig_options.h"
#include "sim/scene.h"

namespace opaline::config {

/// Which back end of a device interface is used.
enum class Driver : std::uint8_t {
  kSim,     ///< the simulated station
  kReplay,  ///< a folder of photographs
};
inline constexpr std::array<std::string_view, 2> kDriverNames{"sim", "replay"};

/// Where the simulated station runs.
enum class RigPlace : std::uint8_t {
  kInside,   ///< in the capture's own process
  kProcess,  ///< as opaline-rig, which outlives whoever drives it, as hardware does
};
inline constexpr std::array<std::string_view, 2> kRigPlaceNames{"inside", "process"};

/// Which calibration of the devices sessions use.
enum class CalibrationUse : std::uint8_t {
  kActive,  ///< the station's active one ("opaline calibrate"), where there is one
  kGiven,   ///< what the rig file says
};
inline constexpr std::array<std::string_view, 2> kCalibrationUseNames{"active", "given"};

/// The simulated station: its sample, how light travels in it, and its devices.
struct SimConfig {
  RigPlace run = RigPlace::kInside;
  std::filesystem::path socket;  ///< of opaline-rig; empty: see rig_socket()
  sim::RigOptions rig;
  sim::SceneOptions scene;
  SimBoardConfig board;             ///< in place of the scene, if it is there
  SimHolderConfig holder;           ///< around the sample
  sim::ResponseOptions transport;   ///< its camera_centre follows from the camera's pose
  std::filesystem::path responses;  ///< stored light transport to look at first; empty: none
  std::filesystem::path cache;      ///< for computed light transport; empty: the user's cache
  bool chart = false;               ///< a ColorChecker lies before the camera instead of the sample
  sim::LedSphereOptions balls;      ///< what a simulated light stage looks at
  std::vector<SphereLight>
      lights;  ///< of that stage, as believed; none: the station has a projector
};

/// A rig file: the devices of a station, and what is known about them.
struct RigConfig {
  std::string station = "demo";  ///< two jobs on one station exclude each other
  Driver camera = Driver::kSim;
  Driver projector = Driver::kSim;
  LightStageConfig light_stage;         ///< in place of the projector, if it has a driver
  std::filesystem::path replay_folder;  ///< photographs and their index
  SimConfig sim;
  CalibrationUse calibration_use = CalibrationUse::kActive;
  /// What is believed of the devices that no active calibration has measured. On a simulated station the truth, unless given.
  capture::StationCalibration calibration;

  /// The board that calibration is told of.
  calibration::GeometryOptions geometry;
  /// By which sessions find the sample before the camera. On a simulated station the truth, unless given.
  calibration::HolderOptions holder;

  bool has_stage() const { return light_stage.driver != StageDriver::kNone; }
  bool is_simulated() const {
    return camera == Driver::kSim ||
           (has_stage() ? light_stage.driver == StageDriver::kSim : projector == Driver::kSim);
  }
};

/// Visits every key of a rig file. `check_files`: files it names must exist.
void visit_rig(Fields& fields, RigConfig& rig, bool check_files);

/// The socket of the station's opaline-rig: as configured, or rig-STATION.sock in
/// $XDG_RUNTIME_DIR/opaline, or without that in /tmp/opaline-UID.
std::filesystem::path rig_socket(const RigConfig& rig);

}  // namespace opaline::config
