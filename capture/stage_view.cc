#include "capture/stage_view.h"

namespace opaline::capture {

std::array<Vec3, 3> axes_of(const CameraModel& camera) {
  const auto& r = camera.camera_from_sample.rotation;
  return {Vec3{r[0], r[1], r[2]}, Vec3{r[3], r[4], r[5]}, Vec3{-r[6], -r[7], -r[8]}};
}

StageRecord stage_view(const CameraModel& camera, double object_depth_mm) {
  StageRecord record;
  record.axes = axes_of(camera);
  const Vec3 eye = camera.centre();
  const double distance = dot(eye, record.axes[2]) - object_depth_mm;
  record.middle = eye - record.axes[2] * distance;
  record.middle_x = camera.cx;
  record.middle_y = camera.cy;
  record.pixel_mm = distance / (0.5 * (camera.fx + camera.fy));
  record.distance_mm = distance;
  return record;
}

}  // namespace opaline::capture
