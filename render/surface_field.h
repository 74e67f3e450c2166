#pragma once

#include <array>

#include "base/block.h"
#include "base/image.h"
#include "base/result.h"

namespace opaline::render {

/// The diffuse light field on one face of a block, over the face's cells (rasters as base/block.h
/// has them).
struct FaceField {
  Image<float> fluence;   ///< phi_s on the surface, 3 channels (RGB), W/mm^2
  Image<float> net_flux;  ///< J_n through it, outwards positive, 3 channels, W/mm^2
  Image<float> reflected =
      {};  ///< off the surface itself, the same in all directions, 3 channels, W/(mm^2 sr);
           ///< empty: none
};

/// What a renderer needs to know of a lit block: the P1 field on its surface, from which
///
///   L(omega) = F_t(eta, omega) / (4 pi eta^2) (phi_s + 3 J_n mu_i),  mu_i = sqrt(1 - (1 - mu_o^2)
///   / eta^2)
///                                                                 (docs/physics.md, "Radiance
///                                                                 towards a camera")
/// follows in any direction, plus what the surface reflects. Between the centres of face cells phi_s and J_n are bilinear, beyond
/// the last constant.
struct SurfaceField {
  Block block;
  double ior = 1.3;                ///< eta, >= 1
  std::array<FaceField, 6> faces;  ///< in the order of Face
};

/// Errors: kInvalidArgument, naming the face, when a raster has the wrong shape or a value is not
/// finite.
Result<void> validate(const SurfaceField& field);

}  // namespace opaline::render
