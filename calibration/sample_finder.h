#pragma once

#include "base/camera_model.h"
#include "base/result.h"
#include "calibration/placement.h"
#include "calibration/step.h"

namespace opaline::calibration {

/// Where the camera stands before the sample in its holder: white light, so bright that next to nothing is full, eight frames averaged,
/// the board found (board_finder.h) and the pose fitted (placement.h). Leaves the projector white. Errors: as place_sample(), and
/// FrameTaker's.
Result<Placement> find_sample(StepContext& context,
                              const CameraModel& lens,
                              const HolderOptions& holder);

}  // namespace opaline::calibration
