#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "render/mesh/signed_distance.h"
#include "render/scene/material_lookup.h"

namespace opaline::render {

struct ShellOptions {
  double depth_mm = 0.0;  ///< of the shell; 0: the block's thickness
  double scale = 1.0;     ///< of the block's lengths
  Vec3 origin{};  ///< where its pattern begins on the surface, in the shape's frame; z is not used
  Tiling tiling = Tiling::kMirror;  ///< along the surface
};

/// A block of material laid around a solid as its shell (Wang 2008, sec. 5; Porumbescu et al., Shell maps, 2005): its z_max
/// face is the surface, and what lies below it follows the surface with depth.
///
/// A place at depth d has its foot s on the surface, the way that the distance falls. Along the surface the block is laid three
/// times, as each axis of the shape's frame sees it, and blended by the normal there, so no chart of the surface is needed and
/// any genus will do:
///
///   c(p) = sum_k w_k block(s_u - origin, s_v - origin, thickness - d),   w_k = n_k^4 / (n_x^4 + n_y^4 + n_z^4)
///
/// with (u, v) = (y, z), (z, x), (x, y) for k = x, y, z, lengths over `scale`. Deeper than the shell the core is interpolated
/// from the shell's inner boundary by mean value coordinates (Ju, Schaefer & Warren, Mean value coordinates for closed triangular
/// meshes, 2005), summed over samples j of it, n_j their normals and a_j their areas:
///
///   c(p) = sum_j w_j c_j / sum_j w_j,    w_j = a_j |n_j . (x_j - p)| / |x_j - p|^4
///
/// Units: mm, 1/mm. Threads: at() may be called from several threads.
class ShellMaterial {
 public:
  /// The solid must outlive it. Errors: kInvalidArgument for lengths that are not above 0; kCancelled.
  static Result<ShellMaterial> create(std::shared_ptr<const Material> block,
                                      const ShellOptions& options,
                                      const SignedDistance& solid,
                                      const Pose& scene_from_shape,
                                      std::stop_token stop);

  Coefficients at(Vec3 place_in_scene) const;
  double depth_mm() const { return options_.depth_mm; }
  std::size_t core_samples() const { return samples_.size(); }  ///< 0: the shell is all there is

 private:
  struct Sample {
    Vec3 place;
    Vec3 area;  // times the normal
    Coefficients value;
  };
  ShellMaterial(std::shared_ptr<const Material> block,
                const ShellOptions& options,
                const SignedDistance& solid,
                const Pose& scene_from_shape)
      : block_(std::move(block)),
        options_(options),
        solid_(&solid),
        shape_from_scene_(scene_from_shape.inverse()) {}
  Result<void> sample_core(std::stop_token stop);
  Coefficients in_shell(Vec3 place, double depth) const;
  Coefficients in_core(Vec3 place) const;

  std::shared_ptr<const Material> block_;
  ShellOptions options_;
  const SignedDistance* solid_;
  Pose shape_from_scene_;
  std::vector<Sample> samples_;
  double blend_mm_ = 0.0;  // over which shell goes over into core
};

}  // namespace opaline::render
