#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/camera_model.h"
#include "calibration/board.h"
#include "calibration/homography.h"

namespace opaline::calibration {

/// From the board's plane (mm) to the picture; none where its corners do not determine it.
std::optional<Homography> board_homography(const Board& board, const BoardView& view);

/// A lens without distortion from views of a board in closed form (Zhang 2000, section 3.1): with K the intrinsic matrix,
/// without skew, and h1, h2 the columns of each view's homography,
///
///   h1' B h2 = 0,  h1' B h1 = h2' B h2,  B = K^-T K^-1.
///
/// Where the views do not determine that (all parallel to the picture), or what they give is no lens: fx = fy about the
/// picture's middle by least squares, and failing that a field of view of 40 degrees.
CameraModel initial_lens(int width, int height, std::span<const Homography> views);

/// camera_from_board of one view under a lens, its distortion left out.
Pose initial_pose(const CameraModel& lens, const Homography& view);

}  // namespace opaline::calibration
