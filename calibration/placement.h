#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/camera_model.h"
#include "base/result.h"
#include "calibration/board.h"

namespace opaline::calibration {

/// A sample's holder: a ChArUco board around the sample, whose squares in the middle are cut out for it.
struct HolderOptions {
  Board board{.kind = Board::Kind::kNone};
  Pose sample_from_board;  ///< where it lies about the sample: of its making

  bool is_there() const { return board.kind != Board::Kind::kNone; }
};
/// Errors: kInvalidArgument naming the member; only a ChArUco board is recognised without its middle.
Result<void> validate(const HolderOptions& options);

/// Small motions of what the camera sees: p_camera = exp([w]x) R p + t + s, with w (rad) and s (mm) along the camera's axes.
using PlaceCovariance = std::array<double, 36>;  ///< of (w, s), row by row

/// Where the camera stands before the sample.
struct Placement {
  Pose camera_from_sample;
  PlaceCovariance covariance{};
  double rms_px = 0.0;  ///< that is left of the reprojection
  double deviation_mm =
      0.0;          ///< standard deviation across the line of sight of the holder's worst corner
  int corners = 0;  ///< that count
};

/// The camera's pose from a view of the holder, its lens being known: closed form (zhang.h), then least squares of the reprojection by
/// Gauss and Newton; corners 4.5 deviations off are left out once. The covariance is that of least squares, (J'J)^-1 times the residuals'
/// own variance.
/// Errors: kInvalidArgument with the remedy: no holder seen, fewer than 8 corners, more than 0.3 px left, or a place unsure to 0.1 mm.
Result<Placement> place_sample(const CameraModel& lens,
                               const HolderOptions& holder,
                               const BoardView& view);

/// JSON and back. Errors of the latter: kInvalidArgument.
std::string to_text(const Placement& placement);
Result<Placement> placement_from_text(std::string_view text, const std::string& file);

}  // namespace opaline::calibration
