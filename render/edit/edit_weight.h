#pragma once

#include <functional>
#include <optional>

#include "render/edit/edit_options.h"
#include "render/edit/mask.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// How much a stroke takes at each place: w of EditOptions.
///
/// Threads: at() may be called from several threads if the distance may.
class EditWeight {
 public:
  /// Of a place in the object's frame: negative inside, mm. Asked only where a stroke needs a depth.
  using DistanceAt = std::function<double(Vec3)>;

  /// Everything must outlive it. A mask's picture lies across the direction, its middle at the centre, two radii wide and
  /// high, its top towards the frame's z, or its y where the direction is along z.
  EditWeight(const EditOptions& edit, const DistanceAt& distance, const Mask* mask);

  double at(Vec3 place) const;
  /// Beyond it the weight is 0.
  Box reach(const Box& object) const;

 private:
  double mask_at(Vec3 from) const;

  const EditOptions& edit_;
  const DistanceAt& distance_;
  const Mask* mask_;
  Vec3 axis_;
  Vec3 right_;
  Vec3 up_;
};

}  // namespace opaline::render
