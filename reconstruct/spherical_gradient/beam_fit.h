#pragma once

#include <span>

#include "base/result.h"

namespace opaline::reconstruct {

/// Scattering parameters from what a thin beam makes leave around it: the reference method of Zhu 2013's Table 1 (after Jensen et al. 2001).
///
///   R_d(s) = alpha'/(4 pi) [ z_r (1 + sigma_tr d_r) e^(-sigma_tr d_r) / d_r^3 + z_v (1 + sigma_tr d_v) e^(-sigma_tr d_v) / d_v^3 ]
///
/// d_r^2 = s^2 + z_r^2, d_v^2 = s^2 + z_v^2, z_r = 3 D, z_v = D (3 + 4 A), sigma_tr = g/(3 D), g^2 = 3 (1 - alpha'): a flat surface's, so the
/// curvature of what is measured is an error of this method.
struct BeamParameters {
  double reduced_albedo = 0.0;
  double diffusion = 0.0;     ///< D, mm
  double translucency = 0.0;  ///< l_d = 1/sigma_tr, mm
  double misfit = 0.0;        ///< root mean square of ln(R_d fitted / R_d measured), by its weights
  int iterations = 0;
};

double dipole_exitance(double reduced_albedo, double diffusion, double ior, double distance);

/// Least squares in ln R_d over (ln D, ln g), by Levenberg and Marquardt. `distance` in mm from the beam; `exitance` in 1/mm^2 over the power
/// that entered; `weight` one over the variance of ln exitance. What is nearer than a mean free path is single scattering's, and better
/// left out by whoever calls.
/// Errors: kInvalidArgument for fewer than 4 points, or none of them > 0; kInternal when it does not settle in 200 iterations.
Result<BeamParameters> fit_beam(std::span<const double> distance,
                                std::span<const double> exitance,
                                std::span<const double> weight,
                                double ior);

}  // namespace opaline::reconstruct
