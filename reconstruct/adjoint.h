#pragma once

#include <span>
#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct {

/// One channel's medium with everything but its fluence that the observation depends on.
struct LitMedium {
  LitMedium(const ChannelProblem& problem, const ChannelCoefficients& coefficients);

  diffusion::Medium medium;
  diffusion::FaceSource light;
  std::vector<diffusion::SurfaceTerms> surface;  ///< per illumination

  /// The right-hand sides of K phi_m = b_m.
  diffusion::FieldBatch right_sides(const ChannelProblem& problem) const;
};

/// L per illumination on the seen face's cells, W/(mm^2 sr), from the fluence.
std::vector<std::vector<double>> radiance(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence);

/// r per illumination, one value a cell of the seen face: dJ/dJ_n, by the net flux out.
using FluxResiduals = std::vector<std::vector<double>>;

/// The right-hand sides of the adjoint, K psi_m = sum_f r_f g_b e_i(f); K is its own adjoint.
diffusion::FieldBatch adjoint_right_sides(const ChannelProblem& problem,
                                          const diffusion::Medium& medium,
                                          const FluxResiduals& residuals);

/// dJ/dkappa and dJ/dsigma_a at fixed kappa, of all illuminations (docs/physics.md, "Gradient, in
/// full"), from fluence and adjoint.
diffusion::MediumGradient medium_gradient(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence,
                                          const diffusion::FieldBatch& adjoint,
                                          const FluxResiduals& residuals);

/// From (d/dlog kappa, d/dlog sigma_a at fixed kappa) to (d/dlog sigma_s', d/dlog sigma_a), all
/// sigma_s' first:
///   d/dlog sigma_s' = - (sigma_s' / sigma_t') d/dlog kappa
///   d/dlog sigma_a  = d/dlog sigma_a at fixed kappa - (sigma_a / sigma_t') d/dlog kappa
std::vector<double> to_parameter_gradient(const ChannelCoefficients& coefficients,
                                          const diffusion::MediumGradient& logs);

}  // namespace opaline::reconstruct
