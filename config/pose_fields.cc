#include "config/pose_fields.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace opaline::config {
namespace {

bool is_rotation(const std::array<double, 9>& r) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double product = 0.0;
      for (int k = 0; k < 3; ++k) product += r[3 * i + k] * r[3 * j + k];
      if (std::abs(product - (i == j ? 1.0 : 0.0)) > 1e-6) return false;
    }
  }
  const Vec3 normal = cross({r[0], r[1], r[2]}, {r[3], r[4], r[5]});
  return dot(normal, {r[6], r[7], r[8]}) > 0.0;
}

}  // namespace

void visit_pose(Fields& fields, Pose& pose, std::string_view from, std::string_view to) {
  const std::string turns =
      fmt::format("of the {}'s frame into the {}'s, 3 x 3, row by row", from, to);
  const std::string moves =
      fmt::format("of the same: p_{} = rotation p_{} + translation", to, from);
  fields.numbers({"rotation", turns}, pose.rotation, Range::between(-1.001, 1.001));
  fields.check(is_rotation(pose.rotation), "rotation", "expected an orthonormal matrix, det +1");
  std::array<double, 3> t{pose.translation.x, pose.translation.y, pose.translation.z};
  fields.numbers({"translation", moves}, t, {}, Unit::kLength);
  pose.translation = {t[0], t[1], t[2]};
}

void visit_projector_lens(Fields& fields, CameraModel& lens) {
  fields.number({"fx", "focal length, its pixels"}, lens.fx, Range::at_least(0.0));
  fields.number({"fy", "the same"}, lens.fy, Range::at_least(0.0));
  fields.number({"cx", "principal point, its pixels"}, lens.cx);
  fields.number({"cy", "the same"}, lens.cy);
  fields.numbers({"distortion", "k1 k2 p1 p2 k3"}, lens.distortion);
  visit_pose(fields, lens.camera_from_sample, "sample", "projector");
}

}  // namespace opaline::config
