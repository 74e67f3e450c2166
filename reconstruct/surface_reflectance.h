#pragma once

#include <optional>
#include <stop_token>

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"
#include "base/surface_reflectance.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// What the surface reflects, from the picture under uniform light less the multiple scattering that the material
/// explains (Wang et al. 2008, section 6.1):
///
///   rho_s(x) = (L(x) - L_material(x)) / E(x)
///
/// L_material is what the material is predicted to send and, on top, what shines on lit cells beyond diffusion
/// (diffusion/lit_surface.h): with true coefficients within 1.1 % of transport's. An error of a percent of L_material is one of
/// L_material / (rho_s E) percent of rho_s, `variance` has the measurement's share alone, and a front-lit fit's absorption is
/// often too low (docs/physics.md): rho_s is then too low, too. A cell that is dark in one channel is masked in all.
///
/// None where the dataset has no picture under uniform light (Dataset::uniform).
/// Errors: kInvalidArgument when dataset and material have different blocks or the lit face is not seen; the solver's;
/// kCancelled.
Result<std::optional<SurfaceReflectance>> surface_reflectance(const Dataset& dataset,
                                                              const Material& material,
                                                              const InverseOptions& options,
                                                              diffusion::FluenceSolver& solver,
                                                              std::stop_token stop);

}  // namespace opaline::reconstruct
