#pragma once

#include <numbers>

#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct::diffusion {

/// Radiance towards a camera of the P1 field under a refracting surface (docs/physics.md, "Radiance
/// towards a camera"):
///
///   L = F_t(eta, mu_o) / (4 pi eta^2) (phi_s + 3 J_n mu_i),   phi_s = S + 2 A J_n,   S = 4 q / (1
///   - R_phi)
///     = source_gain S + flux_gain J_n
///
/// J_n is the net flux out of the surface (M - q), W/mm^2; L in W/(mm^2 sr). On an unlit face S = 0
/// and J_n = M.
struct CameraEquation {
  double source_gain = 0.0;  ///< F_t / (4 pi eta^2), 1/sr
  double flux_gain = 0.0;    ///< F_t (2 A + 3 mu_i) / (4 pi eta^2), 1/sr

  double radiance(double surface_source, double net_flux) const {
    return source_gain * surface_source + flux_gain * net_flux;
  }
};

/// `view_cosine` is mu_o, of the camera's direction to the surface normal, outside; 0 to 1.
inline CameraEquation camera_equation(double ior, const Boundary& boundary, double view_cosine) {
  const double transmittance = 1.0 - fresnel_reflectance(view_cosine, ior);
  const double gain = transmittance / (4.0 * std::numbers::pi * ior * ior);
  return {gain, gain * (2.0 * boundary.a + 3.0 * refracted_cosine(view_cosine, ior))};
}

}  // namespace opaline::reconstruct::diffusion
