#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "calibration/board.h"
#include "calibration/phase_code.h"
#include "calibration/step.h"
#include "calibration/vignetting_fit.h"

namespace opaline::calibration {

/// One pose of the board as camera and projector see it; `fault` of either says why it cannot be used.
struct PosePair {
  BoardView camera;
  BoardView projector;
  Image<std::uint8_t> grey;       ///< in which the camera's corners were found
  std::vector<PaperLight> paper;  ///< its white squares
};

/// The median distance of corners that both have, px; none without such corners.
std::optional<double> corners_moved(const BoardView& before, const BoardView& after);

/// Photographs one pose: white light first, then the patterns (GeometryOptions::projected), then white again. The corners are those of the mean of all sinusoids,
/// which has the least noise; when they are elsewhere in the last white frame than in the first, the pose is `moved`. The light is dimmed until
/// nothing on the board is full.
///
/// Waits as the devices do. Errors: what the devices return.
Result<PosePair> take_pose(StepContext& context,
                           const std::string& name,
                           const Brightness& brightness);

/// How far a pose's corners may move between its first and its last frame, px.
inline constexpr double kMayMove = 0.3;

}  // namespace opaline::calibration
