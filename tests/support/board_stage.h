#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calibration/board.h"
#include "calibration/phase_code.h"
#include "sim/board_optics.h"
#include "sim/sensor.h"

namespace opaline::support {

/// A simulated camera of 480 x 360 and a projector of 640 x 480 pixels that look at chessboards of 10 x 7
/// squares of 13 mm or ChArUco boards of 7 x 5 squares of 20 mm, 350 mm away, with
/// their noise, distortion and blur on; every pose of them is known.
struct BoardStage {
  explicit BoardStage(calibration::Board::Kind kind, int poses);

  sim::CameraOptics camera;
  sim::ProjectorOptics projector;
  sim::BoardSceneOptions scene;
  calibration::Board board;  ///< as the operator believes it to be
  calibration::PhasePlan plan;

  /// The rest is of the scene as it is when first called.
  Image<std::uint16_t> photograph(std::size_t pose, const Image<std::uint8_t>& grey_codes);
  calibration::BoardView camera_view(std::size_t pose);
  calibration::ProjectorMap projector_map(std::size_t pose);

 private:
  std::unique_ptr<sim::BoardOptics> optics_;
  std::unique_ptr<sim::Sensor> sensor_;
  std::uint64_t key_ = 0;
};

}  // namespace opaline::support
