#include "render/deform/deform_options.h"

#include <fmt/format.h>

#include <algorithm>

namespace opaline::render {
namespace {

Result<void> check_cage(const DeformOptions& options) {
  for (const int count : options.points) {
    if (count < 2 || count > 8) {
      return invalid_argument(fmt::format("points: {} along an axis; expected 2 to 8", count));
    }
  }
  for (std::size_t h = 0; h < options.handles.size(); ++h) {
    for (int axis = 0; axis < 3; ++axis) {
      const int at = options.handles[h].point[axis];
      if (at >= -1 && at < options.points[axis]) continue;
      return invalid_argument(
          fmt::format("handle {}: point {} of {} along axis {}; expected 0 to {}, or -1 for all",
                      h + 1,
                      at,
                      options.points[axis],
                      axis,
                      options.points[axis] - 1));
    }
  }
  return ok();
}

Result<void> check_bones(const std::vector<Bone>& bones) {
  if (bones.empty()) return invalid_argument("bones: expected at least one");
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Bone& bone = bones[b];
    if (!(length(bone.tail - bone.head) > 0.0)) {
      return invalid_argument(fmt::format("bone \"{}\": head and tail are one place", bone.name));
    }
    const auto before = bones.begin() + static_cast<std::ptrdiff_t>(b);
    if (!bone.parent.empty() &&
        std::none_of(bones.begin(), before, [&](const Bone& p) { return p.name == bone.parent; })) {
      return invalid_argument(
          fmt::format("bone \"{}\": no bone \"{}\" before it to carry it", bone.name, bone.parent));
    }
  }
  return ok();
}

}  // namespace

Result<void> validate(const DeformOptions& options) {
  if (!(options.amount >= -10.0 && options.amount <= 10.0)) {
    return invalid_argument(fmt::format("amount = {}; expected -10 to 10", options.amount));
  }
  if (options.kind == DeformOptions::Kind::kCage) return check_cage(options);
  if (options.kind == DeformOptions::Kind::kBones) return check_bones(options.bones);
  return ok();
}

}  // namespace opaline::render
