#pragma once

#include <array>
#include <cmath>

namespace opaline {

struct Vec3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  bool operator==(const Vec3&) const = default;
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(Vec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(Vec3 a) { return a * (1.0 / length(a)); }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A rigid motion, named target_from_source: p_target = rotation p_source + translation (mm).
struct Pose {
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major, orthonormal, det +1
  Vec3 translation;

  Vec3 rotate(Vec3 p) const {
    const auto& r = rotation;
    return {r[0] * p.x + r[1] * p.y + r[2] * p.z,
            r[3] * p.x + r[4] * p.y + r[5] * p.z,
            r[6] * p.x + r[7] * p.y + r[8] * p.z};
  }
  Vec3 apply(Vec3 p) const { return rotate(p) + translation; }
  Pose inverse() const {
    const auto& r = rotation;
    Pose inv{{r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}, {}};
    inv.translation = inv.rotate(translation) * -1.0;
    return inv;
  }
  bool operator==(const Pose&) const = default;
};

/// camera_from_sample of a camera at `centre` that looks at `target`, the picture's top towards
/// `up` (not parallel to the line of sight): X right, Y down, Z forward.
inline Pose look_at(Vec3 centre, Vec3 target, Vec3 up) {
  const Vec3 forward = normalized(target - centre);
  const Vec3 right = normalized(cross(forward, up));
  const Vec3 down = cross(forward, right);
  Pose pose{{right.x, right.y, right.z, down.x, down.y, down.z, forward.x, forward.y, forward.z},
            {}};
  pose.translation = pose.rotate(centre) * -1.0;
  return pose;
}

}  // namespace opaline
