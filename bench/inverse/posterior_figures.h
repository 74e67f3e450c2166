#pragma once

#include <string>

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"

namespace opaline::bench {

/// Computes the posterior of a reconstruction and judges it by the truth, over all cells and
/// channels, for log kappa and log sigma_a:
///
///   posterior.coverage_2sigma    share of the cells whose truth is within two standard deviations
///   posterior.z_sd, .z_mean      of (found - truth) / deviation, one figure a layer from the seen
///                                face; .z_sd_least and .z_sd_most over the layers
///   posterior.rms_error          of (found - truth)
///   posterior.bias               mean of z
///   posterior.tightening_top2mm  root mean square of the prior's deviation over the posterior's,
///                                in the 2 mm behind the seen face; ..._of_shape: with the level's
///                                prior left out, how much is learned beyond the mean
/// each about what was reported and, ", posterior mean", about the posterior's own mean;
///
///   budget.measured, .sum, ...   reconstruct/error_budget.h
///   posterior.solves, .seconds   for one right-hand side and channel; all channels
///
/// Returns the posterior's mean.
Result<Material> print_posterior(const std::string& name,
                                 const Dataset& dataset,
                                 const Material& truth,
                                 const reconstruct::InverseResult& result,
                                 const reconstruct::InverseOptions& options,
                                 reconstruct::diffusion::FluenceSolver& solver);

}  // namespace opaline::bench
