#pragma once

#include "base/block.h"
#include "base/image.h"
#include "render/surface_field.h"

namespace opaline::daemon {

/// Radiance of a face's cells at those cosines, 3 channels, by the camera equation of the P1 field
///
///   L = F_t(eta, mu_o) / (4 pi eta^2) (phi_s + 3 J_n mu_i)                       (docs/physics.md)
Image<float> surface_radiance(const render::SurfaceField& field,
                              Face face,
                              const Image<float>& cosines);

}  // namespace opaline::daemon
