#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "base/material.h"
#include "render/graph/optics.h"
#include "render/scene/scene.h"
#include "render/scene/shell_material.h"

namespace opaline::render {

/// The coefficients of a translucent object by place, as if it were cut from a block of the material (solid placement), or with
/// a block laid around it (wrap(), render/scene/shell_material.h):
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

  /// Lays the block around a solid, where the options place it as a shell. The solid must outlive it. Errors: those of
  /// ShellMaterial.
  Result<void> wrap(const SignedDistance& solid, std::stop_token stop);

  Optics at(Vec3 place_in_scene) const;
  /// The file's block; none where there is no file.
  const std::shared_ptr<Material>& block() const { return block_; }
  /// From now on this block, its corner at `origin` in the shape's frame, clamped beyond it.
  void take_block(std::shared_ptr<Material> block, Vec3 origin);
  double ior() const { return ior_; }
  /// None where the material is placed solidly.
  const ShellMaterial* shell() const { return shell_ ? &*shell_ : nullptr; }
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
  std::optional<ShellMaterial> shell_;
};

}  // namespace opaline::render
