#pragma once

#include <stop_token>
#include <vector>

#include "base/material.h"
#include "base/result.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// One channel's pictures of a material, per illumination on the seen face's cells, and what the grid leaves out of them.
struct GridCorrection {
  std::vector<std::vector<double>> predicted;  ///< L^h
  std::vector<std::vector<double>> change;     ///< delta
  long solves = 0;  ///< that it took, counted in solves on the problem's own grid
};

/// What a grid of cells h leaves out of the pictures of a material: the change when every cell is cut into eight of the same
/// coefficients, and Richardson's third of it more, the scheme being of second order,
///
///   delta_m(x) = 4/3 (L_m^(h/2) - L_m^h)(x)
///
/// so that L^h + delta is of higher order. Against finite elements on a grid twice as fine, at the true coefficients of
/// 48 x 48 x 12 cells, E falls from 1.3e-4 to 6e-6 (docs/physics.md).
///
/// Fine solves are done for sixteen illuminations at a time: eight times the memory of such a solve on the problem's grid.
/// Errors: those of Objective::predict().
Result<GridCorrection> grid_correction(const ChannelProblem& problem,
                                       const ChannelCoefficients& coefficients,
                                       double tolerance,
                                       diffusion::FluenceSolver& solver,
                                       const std::stop_token& stop);

/// The problem with what the grid leaves out taken off its radiances, L* - delta: a deferred correction, which leaves the
/// model on its own grid.
ChannelProblem corrected(ChannelProblem problem, const GridCorrection& correction);

/// ||delta||^2 and ||L^h + delta||^2 over the usable data.
struct CorrectionPower {
  double change = 0.0;
  double pictures = 0.0;
  double relative() const;  ///< ||delta|| / ||L^h + delta||; 0 in the dark
};
CorrectionPower power(const ChannelProblem& problem, const GridCorrection& correction);

/// Whether the grid is corrected for: where InverseOptions::grid_correction asks for it, channels are fitted one by one,
/// not as published, and the cut cells are few enough for memory (kMostCorrectedCells of the block's own).
bool corrects_grid(const InverseOptions& options, const Block& block);
inline constexpr std::size_t kMostCorrectedCells = 500'000;

}  // namespace opaline::reconstruct
