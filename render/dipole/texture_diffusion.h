#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/pose.h"
#include "base/result.h"
#include "base/thread_team.h"

namespace opaline::render {

/// A surface sampled on a raster: of a texture (texture-space diffusion, d'Eon et al. 2007), where neighbours on the surface are neighbours in the raster,
/// or of a picture (screen-space diffusion), whose gaps no light crosses but as it does within `positions`.
struct TexelSurface {
  int width = 0;
  int height = 0;
  double texel_mm = 1.0;  ///< between neighbours, about: how far a kernel reaches in texels
  std::vector<Vec3> position = {};         ///< mm
  std::vector<Vec3> normal = {};           ///< unit
  std::vector<float> area = {};            ///< mm^2
  std::vector<std::uint8_t> covered = {};  ///< 0: no surface there
  std::vector<float> reduced_albedo = {};  ///< alpha'
  std::vector<float> diffusion = {};       ///< D, mm, > 0 where covered
};

/// Light from all sides, L(omega) = constant + gradient . omega, W/(mm^2 sr).
struct LinearLight {
  double constant = 1.0;
  Vec3 gradient;
};

/// Radiant exitance by the dipole (Jensen et al. 2001) summed over texels,
///
///   M(x) = sum_y q(y) A_y R_d(|x - y|; alpha'(x), D(x)),   q = 2 pi (L_0 int Ft mu dmu + (g . n) int Ft mu^2 dmu)
///
/// R_d as in reconstruct/spherical_gradient/beam_fit.h, x and y's own texel by its integral over the disc of the same area. Texels beyond 8 l_d are
/// left out. Nothing shades. Threads: as `team`. Errors: kInvalidArgument where sizes do not fit.
Result<std::vector<float>> diffuse_texels(const TexelSurface& surface,
                                          const LinearLight& light,
                                          double ior,
                                          ThreadTeam& team);

}  // namespace opaline::render
