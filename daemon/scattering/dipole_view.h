#pragma once

#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "daemon/scattering/relief.h"
#include "daemon/scattering/sphere_maps.h"

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

/// Captured on the left, rendered on the right, each place enlarged `times`.
Image<float> side_by_side(const DipoleView& view, int times);

}  // namespace opaline::daemon
