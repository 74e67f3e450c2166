#include "base/camera_model.h"

namespace opaline {
namespace {

CameraModel::Pixel distort(const std::array<double, 5>& d, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x),
          y * radial + d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y};
}

}  // namespace

CameraModel::Pixel CameraModel::project(Vec3 point_in_sample) const {
  const Vec3 p = camera_from_sample.apply(point_in_sample);
  const Pixel q = distort(distortion, p.x / p.z, p.y / p.z);
  return {fx * q.x + cx, fy * q.y + cy};
}

Vec3 CameraModel::ray_direction(Pixel pixel) const {
  const Pixel target{(pixel.x - cx) / fx, (pixel.y - cy) / fy};
  Pixel guess = target;
  for (int i = 0; i < 20; ++i) {
    const Pixel seen = distort(distortion, guess.x, guess.y);
    guess.x += target.x - seen.x;
    guess.y += target.y - seen.y;
  }
  return normalized(camera_from_sample.inverse().rotate({guess.x, guess.y, 1.0}));
}

}  // namespace opaline
