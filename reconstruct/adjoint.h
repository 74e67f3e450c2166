#pragma once

#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"
#include "reconstruct/observation.h"

namespace opaline::reconstruct {

/// dJ/dkappa and dJ/dsigma_a at fixed kappa, of all illuminations (docs/physics.md, "Gradient, in
/// full"), from fluence and adjoint.
diffusion::MediumGradient medium_gradient(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence,
                                          const diffusion::FieldBatch& adjoint,
                                          const RadianceResiduals& residuals);

/// From (d/dlog kappa, d/dlog sigma_a at fixed kappa) to (d/dlog sigma_s', d/dlog sigma_a), all
/// sigma_s' first:
///   d/dlog sigma_s' = - (sigma_s' / sigma_t') d/dlog kappa
///   d/dlog sigma_a  = d/dlog sigma_a at fixed kappa - (sigma_a / sigma_t') d/dlog kappa
std::vector<double> to_parameter_gradient(const ChannelCoefficients& coefficients,
                                          const diffusion::MediumGradient& logs);

}  // namespace opaline::reconstruct
