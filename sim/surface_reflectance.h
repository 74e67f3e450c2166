#pragma once

#include <cstdint>

#include "base/block.h"
#include "base/image.h"
#include "base/result.h"

namespace opaline::sim {

/// What the sample's own surface reflects towards the camera, on top of what diffuses: a texture, as smudges and
/// polish leave it, fixed for the station's one geometry of light and view,
///
///   L_s = rho_s E,   rho_s = reflectance exp(contrast n(x)),  n in about -1 to 1, the same in all channels.
///
/// The light that enters is not made less by it: rho_s is small against 1.
struct SurfaceOptions {
  double reflectance = 0.0;  ///< of the ground, 1/sr; 0 (none) to 0.3
  double contrast = 0.7;     ///< 0: even; 0 to 3
  double feature_mm = 5.0;   ///< of the texture; > 0
  std::uint64_t seed = 1;
};
Result<void> validate(const SurfaceOptions& options);

/// rho_s over a face's cells, 3 channels, 1/sr: the truth that a capture is to recover.
Image<float> surface_reflectance(const SurfaceOptions& options, const Block& block, Face face);

}  // namespace opaline::sim
