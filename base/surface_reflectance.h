#pragma once

#include <cstdint>

#include "base/block.h"
#include "base/image.h"

namespace opaline {

/// What the surface of the lit face reflects towards the camera by itself, without entering the material: the radiance
/// under the session's perpendicular light is rho_s E on top of what diffuses (Wang et al. 2008, section 6.1). It holds
/// for that direction of light and view.
///
/// Shapes: rasters over the cells of `face`.
struct SurfaceReflectance {
  Block block;  ///< the sample's
  Face face = Face::kZMax;
  Image<float>
      reflectance;  ///< rho_s, 3 channels, 1/sr; noise may make it negative; 0 where masked
  Image<float>
      variance;  ///< of the measurement, the same shape; the material's own error is not in it
  Image<std::uint8_t> mask;  ///< 1 channel: 1 = measured
};

}  // namespace opaline
