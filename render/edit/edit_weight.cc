#include "render/edit/edit_weight.h"

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

/// 1 up to (1 - softness), 0 from 1 on.
double falloff(double share, double softness) {
  if (share >= 1.0) return 0.0;
  if (share <= 1.0 - softness) return 1.0;
  const double t = (1.0 - share) / softness;
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

EditWeight::EditWeight(const EditOptions& edit, const DistanceAt& distance, const Mask* mask)
    : edit_(edit), distance_(distance), mask_(mask), axis_(normalized(edit.direction)) {
  const Vec3 top = std::abs(axis_.z) < 0.999 ? Vec3{0.0, 0.0, 1.0} : Vec3{0.0, 1.0, 0.0};
  right_ = normalized(cross(top, axis_));
  up_ = cross(axis_, right_);
}

double EditWeight::mask_at(Vec3 from) const {
  const double across = 0.5 / edit_.radius_mm;
  return mask_->at(0.5 + across * dot(from, right_), 0.5 - across * dot(from, up_));
}

double EditWeight::at(Vec3 place) const {
  const Vec3 from = place - edit_.centre;
  const bool ball = edit_.reach == EditOptions::Reach::kBall;
  const Vec3 away = ball ? from : from - axis_ * dot(from, axis_);
  double weight = edit_.strength * falloff(length(away) / edit_.radius_mm, edit_.softness);
  if (weight > 0.0 && mask_ != nullptr) weight *= mask_at(from);
  if (weight > 0.0 && edit_.reach == EditOptions::Reach::kDepth) {
    const double off = std::abs(-distance_(place) - edit_.depth_mm);
    weight *= falloff(2.0 * off / edit_.thickness_mm, edit_.softness);
  }
  return weight;
}

Box EditWeight::reach(const Box& object) const {
  if (edit_.reach != EditOptions::Reach::kBall) return object;
  const Vec3 r{edit_.radius_mm, edit_.radius_mm, edit_.radius_mm};
  return {edit_.centre - r, edit_.centre + r};
}

}  // namespace opaline::render
