#pragma once

#include <array>

#include "base/camera_model.h"
#include "base/stage_record.h"

namespace opaline::capture {

/// The camera's directions along a row, down a column, and back towards itself.
std::array<Vec3, 3> axes_of(const CameraModel& camera);

/// How a camera's pictures lie in the sphere of lights: the record's axes, middle, pixel_mm and distance_mm, of the plane through the object's outline, `object_depth_mm` before the
/// sphere's middle. Nothing else is set.
StageRecord stage_view(const CameraModel& camera, double object_depth_mm);

}  // namespace opaline::capture
