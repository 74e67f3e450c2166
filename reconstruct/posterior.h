#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

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
  double discrepancy = 0.01;           ///< eps of DiscrepancyShapes: the model's smooth error; >= 0
  std::size_t cells = 4096;  ///< at most, of the grid the pictures' information lives on; >= 1
  std::size_t diffusion_modes = 1200;  ///< cosines of log kappa that the pictures may inform; >= 1
  std::size_t absorption_modes = 300;  ///< of log sigma_a; >= 1
  double tolerance = 1e-6;             ///< of the diffusion solves; > 0
  int threads = 0;                     ///< of the algebra; 0: one a core
};

/// How well one channel is known.
struct ChannelPosterior {
  LogCoefficients deviation;  ///< about the estimate: (variance + shift^2)^(1/2)
  LogCoefficients shift;    ///< the posterior's mean less the estimate; of sigma_s' to first order
  PriorOptions diffusion;   ///< as used
  PriorOptions absorption;  ///< as used
  double determined_diffusion =
      0.0;  ///< effective number of parameters that the pictures determine
  double determined_absorption = 0.0;
  double held_out_variance = 0.0;  ///< of the held-out radiances, summed: trace(J C J^T)
  Block grid;                      ///< that the information was computed on
  long solves = 0;  ///< for one right-hand side; all but one an illumination on `grid`
};

/// Posterior standard deviations of log kappa, log sigma_a and log sigma_s' per cell: the Laplace
/// approximation with Gauss-Newton's Hessian at `estimate`,
///
///   u = mean + F y,   y ~ N(0, S^2) a priori (CosinePrior),   A = J F,
///   C = F (S^-2 + A^T R^-1 A)^-1 F^T + what the prior leaves to the cosines not in F
///
/// with J the Jacobian of the whitened radiances sqrt(w) L by (log kappa, log sigma_a) and R the
/// covariance of their errors: 1 for the measured noise and InverseOptions::model_error in w, and the
/// model's smooth discrepancy (reconstruct/discrepancy.h).
///
/// The reconstruction is not this prior's maximum: it minimises with the regulariser and stops at
/// the noise. So a deviation about it is (C_ii + shift_i^2)^(1/2), the shift to the posterior's mean by one
/// Gauss-Newton step in the same cosines:
///
///   shift = mean + F y - estimate,   y = (S^-2 + A^T R^-1 A)^-1 A^T R^-1 g,   g = J d - r
///
/// d: the kept cosines' part of the estimate less its mean, r its whitened residual. What the estimate has
/// beyond the kept cosines stays in r: in d, which they would have to make good, it moved the
/// mean by several deviations. Where the model bends, one step is not all: see docs/physics.md.
///
/// J is not probed by products, two batched solves each for hundreds of cosines, but written down
/// row by row by reciprocity (Arridge, Inverse Problems 15, R41 (1999), sec. 5): one solve for each
/// illumination and one for each point of the seen face give every row, the adjoint gradient of that
/// one datum. This is done on a coarser grid, and for the smoothest cosines: what these cannot resolve
/// keeps its prior variance, and is not counted among what blurs the rest. The amplitude of log kappa by
/// the largest evidence (MacKay, Neural Computation 4, 415 (1992)):
///
///   log p(data | S) = -1/2 (g^T R^-1 g - h^T y) - 1/2 log det(1 + S A^T R^-1 A S),   h = A^T R^-1 g
///
/// Memory: about 8 (modes^2 (2 + threads) + modes shapes pictures + seen coarse cells (cells + modes threads)) bytes.
/// Errors:  kInvalidArgument for options; kCancelled; the solver's; kInternal when a solve stays
/// far from its tolerance or the Hessian is not finite.
Result<ChannelPosterior> posterior(const ChannelProblem& problem,
                                   diffusion::FluenceSolver& solver,
                                   const ChannelCoefficients& estimate,
                                   const PosteriorOptions& options,
                                   std::stop_token stop);
/// Also how uncertain the posterior leaves the pictures of `held_out`, of the same sample.
Result<ChannelPosterior> posterior(const ChannelProblem& problem,
                                   const ChannelProblem& held_out,
                                   diffusion::FluenceSolver& solver,
                                   const ChannelCoefficients& estimate,
                                   const PosteriorOptions& options,
                                   std::stop_token stop);
Result<void> validate(const PosteriorOptions& options);

}  // namespace opaline::reconstruct
