#pragma once

#include <string_view>

#include "base/camera_model.h"
#include "base/pose.h"
#include "config/fields.h"

namespace opaline::config {

/// The keys "rotation" and "translation" of a pose, which takes one frame into another.
void visit_pose(Fields& fields,
                Pose& pose,
                std::string_view from = "sample",
                std::string_view to = "camera");

/// A projector's lens as an inverse camera: fx, fy, cx, cy, distortion and the pose of the sample before it.
void visit_projector_lens(Fields& fields, CameraModel& lens);

}  // namespace opaline::config
