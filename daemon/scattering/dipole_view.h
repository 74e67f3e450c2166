#pragma once

#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "daemon/scattering/relief.h"
#include "daemon/scattering/sphere_maps.h"
#include "render/dipole/texture_diffusion.h"

namespace opaline::daemon {

/// The captured view drawn again from its maps: dipoles summed over the seen surface (render/dipole/texture_diffusion.h), beside what the camera saw.
struct DipoleView {
  std::string name;  ///< of the pattern
  Image<float>
      captured;  ///< radiance over a white surface's, red green blue, on the relief's places; 0 where nothing was measured
  Image<float> rendered;
  double error = 0.0;  ///< relative root mean square over the places drawn and all channels
  double scale = 0.0;  ///< rendered over captured, in total
};

/// Under the constant pattern, in texture space and ("screen_space") in that of the picture, and under the shifted gradients. Places without an answer take their nearest; exitance leaves evenly below the surface.
/// Errors: kInvalidArgument where some channel has no answer at all; kCancelled.
Result<std::vector<DipoleView>> dipole_views(const SphereMaps& maps,
                                             const SphereSession& session,
                                             double ior,
                                             std::stop_token stop);

/// The seen surface as texels of the relief's places, x along a row, y down a column, z towards the camera; without its maps.
render::TexelSurface seen_surface(const SphereMaps& maps, const Relief& relief);

/// Each place `times` as wide and high.
Image<float> enlarged(const Image<float>& picture, int times);
/// Two pictures of three channels beside one another, the lower one in the middle of black.
Image<float> beside(const Image<float>& left, const Image<float>& right);

}  // namespace opaline::daemon
