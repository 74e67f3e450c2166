#pragma once

#include <array>

#include "base/pose.h"

namespace opaline {

/// A pinhole camera with Brown's radial and tangential distortion (Zhang 2000; OpenCV's order of
/// coefficients).
///
///   (x, y) = (X/Z, Y/Z),  r2 = x2 + y2,  c = 1 + k1 r2 + k2 r2^2 + k3 r2^3
///   x' = x c + 2 p1 x y + p2 (r2 + 2 x2),  y' = y c + p1 (r2 + 2 y2) + 2 p2 x y
///   pixel = (fx x' + cx, fy y' + cy)
///
/// Units: pixels, top row first, pixel centres at .5; the camera looks along +Z, X right, Y down;
/// mm elsewhere. A projector is the same thing backwards.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
  Pose camera_from_sample;

  struct Pixel {
    double x = 0.0;
    double y = 0.0;
  };
  /// Where a point of the sample's frame (mm) is seen; the point must lie in front of the camera.
  Pixel project(Vec3 point_in_sample) const;
  /// Whether the camera looks towards a point: Z > 0, which a camera turned away would project too,
  /// but upside down.
  bool faces(Vec3 point_in_sample) const {
    return camera_from_sample.apply(point_in_sample).z > 0.0;
  }
  /// The direction, in the sample's frame, of the ray through a pixel; undoes the distortion by
  /// iteration.
  Vec3 ray_direction(Pixel pixel) const;
  /// The camera's centre in the sample's frame.
  Vec3 centre() const { return camera_from_sample.inverse().translation; }
  bool operator==(const CameraModel&) const = default;
};

}  // namespace opaline
