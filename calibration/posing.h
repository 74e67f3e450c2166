#pragma once

#include <chrono>
#include <vector>

#include "calibration/pose_taker.h"
#include "calibration/step.h"

namespace opaline::calibration {

/// Poses of the board as camera and projector saw them; aligned.
struct Poses {
  std::vector<BoardView> camera;
  std::vector<BoardView> projector;
  std::vector<std::vector<PaperLight>> paper;
};

/// How long a pose is waited for when a person holds the board; in real time, also where the station's clock is faster.
inline constexpr std::chrono::seconds kPosePatience{90};
/// So many poses in a row that nobody came to hold end it.
inline constexpr int kNobodyThere = 3;

/// Has the board shown in context.geometry.poses poses, and takes each (pose_taker.h). The lamp goes dark before each, for
/// time_to_move. Where context.attendant holds the board, it goes dark for a second only; then, in white light, a pose is waited for
/// until the board is seen, its corners are a fiftieth of the picture's width from where they were in any pose before, and two
/// pictures in a row show them in one place (0.5 px), or until the attendant says so.
///
/// Facts: pose.taken {pose, poses, corners, blur_px, fault, tilt_deg, distance_mm, fields, coverage, tilts, rms_px?, pose_rms_px?,
/// next, message}. A pose that nobody came to hold is one with a fault.
/// Errors: kTimeout once that has happened kNobodyThere times in a row; kCancelled; what the devices return.
Result<Poses> take_poses(StepContext& context, const Brightness& brightness);

}  // namespace opaline::calibration
