#pragma once

#include <cstddef>
#include <stop_token>

#include "base/block.h"
#include "base/material.h"
#include "base/result.h"
#include "base/uncertainty.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct {

/// What is believed of one coefficient's logarithm before a picture is seen: a level that nobody
/// knows, and a heterogeneity about it of some amplitude and size.
struct PriorOptions {
  double level = 1.5;      ///< standard deviation of the level; >= 0. 1.5: within a factor e^3 = 20
  double amplitude = 0.5;  ///< standard deviation of a cell about the level; > 0
};

/// What the posterior assumes, and how finely it is computed.
///
/// The amplitudes are those of the natural stones and waxes that the simulated samples imitate. The
/// pictures say how much kappa varies, so its amplitude is only where the search for it starts; of
/// how much sigma_a varies they say too little, and its amplitude is an assumption.
struct PosteriorOptions {
  PriorOptions diffusion{1.5, 0.25};   ///< of log kappa
  PriorOptions absorption{1.5, 0.45};  ///< of log sigma_a
  double length_mm = 2.0;              ///< correlation length of both; > 0
  bool find_amplitude = true;          ///< of log kappa, by the largest evidence
  std::size_t cells = 4096;  ///< at most, of the grid the pictures' information lives on; >= 1
  std::size_t diffusion_modes = 1200;  ///< cosines of log kappa that the pictures may inform; >= 1
  std::size_t absorption_modes = 300;  ///< of log sigma_a; >= 1
  double tolerance = 1e-6;             ///< of the diffusion solves; > 0
  int threads = 0;                     ///< of the algebra; 0: one a core
};

/// How well one channel is known.
struct ChannelPosterior {
  ChannelUncertainty deviation;
  PriorOptions diffusion;   ///< as used
  PriorOptions absorption;  ///< as used
  double determined_diffusion =
      0.0;  ///< effective number of parameters that the pictures determine
  double determined_absorption = 0.0;
  Block grid;       ///< that the information was computed on
  long solves = 0;  ///< for one right-hand side; all but one an illumination on `grid`
};

/// Posterior standard deviations of log kappa, log sigma_a and log sigma_s' per cell: the Laplace
/// approximation with Gauss-Newton's Hessian at `estimate`,
///
///   u = F y,   y ~ N(0, S^2) a priori (CosinePrior),   A = J F,
///   cov(u) = F (S^-2 + A^T A)^-1 F^T + what the prior leaves to the cosines not in F
///
/// with J the Jacobian of the whitened radiances sqrt(w) L by (log kappa, log sigma_a): the weights
/// hold the measured noise and InverseOptions::model_error, so a known discrepancy of the model
/// counts as noise.
///
/// J is not probed by products, two batched solves each for hundreds of cosines, but written down
/// row by row by reciprocity (Arridge, Inverse Problems 15, R41 (1999), sec. 5): one solve for each
/// illumination and one for each point of the seen face give every row, the adjoint gradient of that
/// one datum. This is done on a coarser grid, and for the smoothest cosines: what these cannot resolve
/// keeps its prior variance, and is not counted among what blurs the rest. Amplitudes by the largest evidence
/// (MacKay, Neural Computation 4, 415 (1992)):
///
///   log p(data | S) = -1/2 (|g|^2 - h^T y) - 1/2 log det(1 + S A^T A S),   h = A^T g, g = J d - r
///
/// d the estimate less its mean, r its whitened residual.
///
/// The reconstruction is not this prior's maximum: it minimises with the regulariser and stops at
/// the noise. The deviations are those of the posterior at that point, not about another; what the
/// early stop adds to the error, 10 to 30 % of it on simulated samples far from the seen face, is
/// not in them.
///
/// Memory: about 8 (modes^2 (2 + threads) + seen coarse cells (cells + modes threads)) bytes.
/// Errors:  kInvalidArgument for options; kCancelled; the solver's; kInternal when a solve stays
/// far from its tolerance or the Hessian is not finite.
Result<ChannelPosterior> posterior(const ChannelProblem& problem,
                                   diffusion::FluenceSolver& solver,
                                   const ChannelCoefficients& estimate,
                                   const PosteriorOptions& options,
                                   std::stop_token stop);
Result<void> validate(const PosteriorOptions& options);

}  // namespace opaline::reconstruct
