#pragma once

#include <memory>

#include "base/material.h"
#include "render/graph/optics.h"
#include "render/scene/scene.h"

namespace opaline::render {

/// The coefficients of a translucent object by place, as if it were cut from a block of the material (solid placement):
///
///   from a file   trilinear between the centres of the block's cells, which begins at `origin` in the shape's frame and is
///                 `scale` times as large; beyond it the block is clamped, repeated or mirrored
///   else          the same everywhere, or a pattern (PatternOptions)
///
///   kappa = 1 / (3 (sigma_a + sigma_s'))
///
/// Threads: at() may be called from several threads.
class MaterialSource {
 public:
  /// Errors: those of read_material(); kInvalidArgument for a block with a cell that does not scatter.
  static Result<MaterialSource> create(const TranslucentOptions& options,
                                       const Pose& scene_from_shape);

  Optics at(Vec3 place_in_scene) const;
  /// The file's block; none where there is no file.
  const std::shared_ptr<Material>& block() const { return block_; }
  /// From now on this block, its corner at `origin` in the shape's frame, clamped beyond it.
  void take_block(std::shared_ptr<Material> block, Vec3 origin);
  double ior() const { return ior_; }
  /// Whether every place has the same coefficients.
  bool is_homogeneous() const;

 private:
  MaterialSource(const TranslucentOptions& options, const Pose& scene_from_shape)
      : options_(options), shape_from_scene_(scene_from_shape.inverse()), ior_(options.ior) {}
  Optics in_block(Vec3 place) const;
  double pattern_weight(Vec3 place) const;

  TranslucentOptions options_;
  Pose shape_from_scene_;
  double ior_;
  std::shared_ptr<Material> block_;  // none: options_'s own
};

/// Where a coordinate beyond 0 to n - 1 is looked up, by tiling: a place between cell centres again.
double tiled(double coordinate, int cells, Tiling tiling);

}  // namespace opaline::render
