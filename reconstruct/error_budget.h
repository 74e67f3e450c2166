#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// What the relighting error of the held-out lights is made of. Each is a root mean square over usable cells and channels,
/// relative to that of the radiances; independent, so squares add.
struct ErrorBudget {
  double measured = 0.0;  ///< ||L - L*|| / ||L*||, to be explained
  double noise = 0.0;     ///< of the held-out pictures, as measured
  double calibration =
      0.0;  ///< what an inexact calibration adds to it (Illumination::calibration_share)
  /// What the pictures of the fit keep beyond their noise and the grid's error: what no material of the model explains.
  double model = 0.0;
  double discretisation = 0.0;  ///< discretisation_error()
  double undetermined =
      0.0;  ///< (sum of trace(J C J^T))^(1/2) / ||L*|| (ChannelPosterior::held_out_variance)

  double sum() const;  ///< of all but `measured`
};

/// `predicted`: a picture an illumination of the dataset. `held_out_variance`: of the posterior, the channels' sum.
/// Nothing where no light was held out, or all are dark.
std::optional<ErrorBudget> error_budget(const Dataset& dataset,
                                        const std::vector<Image<float>>& predicted,
                                        double discretisation,
                                        double held_out_variance);

/// Error of the grid, relative to the pictures, over at most four held-out lights: grid_correction() or, where the answer
/// was found with that (corrects_grid()), a quarter of it, the part that Richardson's rule adds unseen.
/// Errors: those of grid_correction(); kInvalidArgument where nothing is held out.
Result<double> discretisation_error(const Dataset& dataset,
                                    const Material& material,
                                    const InverseOptions& options,
                                    diffusion::FluenceSolver& solver,
                                    std::stop_token stop);

/// The held-out pictures of one channel, every usable datum of weight 1; nothing where there are none.
Result<std::optional<ChannelProblem>> held_out_problem(const Dataset& dataset,
                                                       int channel,
                                                       const InverseOptions& options);

}  // namespace opaline::reconstruct
