#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "base/pose.h"
#include "calibration/board.h"

namespace opaline::calibration {

/// How one pose of the board lies before the camera, by the lens that all of them tell in closed form (zhang.h): good to some degrees.
struct PoseLie {
  double right_deg = 0.0;    ///< > 0: the edge at the right of the picture is nearer
  double down_deg = 0.0;     ///< > 0: the lower one
  double distance_mm = 0.0;  ///< of the board's middle
  double tilt_deg() const;   ///< of its normal off the line of sight
};

/// Of a pose that is known.
PoseLie lie_of(const Pose& camera_from_board, const Board& board);

/// What a set of poses covers and lacks, so that whoever holds the board knows where to hold it next. A focal length needs tilts of
/// 15 to 40 degrees in all directions and distances that differ (Zhang 2000, section 4; Sturm & Maybank 1999: views parallel to the
/// picture tell none), distortion needs corners everywhere.
struct PoseGuide {
  static constexpr int kAcross = 8;
  static constexpr int kDown = 6;
  static constexpr double kLeastTilt = 12.0;  ///< degrees; less counts as flat
  /// Corners by field of the picture, rows from the top.
  std::array<int, static_cast<std::size_t>(kAcross) * kDown> fields{};
  double coverage = 0.0;  ///< share of the fields with a corner
  int poses = 0;          ///< that count: those without a fault
  int left_nearer = 0;    ///< poses tilted mainly that way
  int right_nearer = 0;
  int top_nearer = 0;
  int bottom_nearer = 0;
  int flat = 0;
  double nearest_mm = 0.0;
  double farthest_mm = 0.0;
  std::vector<PoseLie> lies;  ///< of each view; zeros where it has a fault
  /// "towards the upper left, its left edge 15 to 40 degrees nearer": what lacks most.
  std::string wish;
};

/// Views with a fault do not count. Shapes: the picture is width x height pixels. Threads: any.
PoseGuide guide_poses(int width, int height, const Board& board, std::span<const BoardView> views);

}  // namespace opaline::calibration
