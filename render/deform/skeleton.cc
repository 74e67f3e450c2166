#include "render/deform/skeleton.h"

#include <algorithm>

#include "render/mesh/turn.h"

namespace opaline::render {
namespace {

/// The square of the distance from a place to a segment.
double squared_distance(Vec3 place, Vec3 head, Vec3 along) {
  const Vec3 from = place - head;
  const double share = std::clamp(dot(from, along) / dot(along, along), 0.0, 1.0);
  const Vec3 way = from - along * share;
  return dot(way, way);
}

}  // namespace

Skeleton::Skeleton(const DeformOptions& options) {
  for (const Bone& bone : options.bones) {
    std::array<double, 3> degrees = bone.rotation_degrees;
    for (double& angle : degrees) angle *= options.amount;
    Pose turn = turned_about_axes(degrees);
    turn.translation = bone.head - turn.rotate(bone.head) + bone.move * options.amount;
    const auto parent =
        std::ranges::find_if(options.bones, [&](const Bone& b) { return b.name == bone.parent; });
    const auto carrier = static_cast<std::size_t>(parent - options.bones.begin());
    if (!bone.parent.empty() && carrier < bones_.size()) {
      turn = chained(bones_[carrier].now_from_rest, turn);
    }
    bones_.push_back({bone.head, bone.tail - bone.head, turn});
  }
}

Vec3 Skeleton::at(Vec3 rest) const {
  Vec3 sum;
  double weights = 0.0;
  for (const Carrier& bone : bones_) {
    const double square = std::max(squared_distance(rest, bone.head, bone.along), 1e-12);
    const double weight = 1.0 / (square * square);
    sum = sum + bone.now_from_rest.apply(rest) * weight;
    weights += weight;
  }
  return sum * (1.0 / weights);
}

}  // namespace opaline::render
