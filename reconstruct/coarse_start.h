#pragma once

#include <optional>
#include <stop_token>

#include "reconstruct/channel_solver.h"

namespace opaline::reconstruct {

/// Where a channel's minimisation starts: the answer on a coarser grid of the same block (reconstruct/coarse_grid.h),
/// which is found the same way, from still coarser ones while options.coarser_grids allows; the homogeneous fit is on
/// the coarsest. A coarse grid stops at chi^2 = the number of data, noise and model_error in full: closer, it would
/// fit its own discretisation; or after ten iterations that gain less than a tenth, or thirty in all. Where `from` is
/// there already, it stays as it is.
///
/// Brought to the finer grid: the logarithms, trilinear, and what L-BFGS learnt of the curvature, s likewise and y spread
/// over the finer cells, so that s . y stays what it was and the first step is a good one. Solves are counted in fine
/// ones, each coarse one for its share of the cells.
///
/// Where asked, each of HomogeneousFit::rivals is a start on `coarse` as well, and the lowest end is gone on from: which
/// of two homogeneous samples the veins are about shows once there are veins. Still coarser grids have errors larger than
/// what tells them apart.
///
/// `from`, on the fine grid, replaces the homogeneous fit. Errors: ChannelSolver's.
Result<ChannelSolver::WarmStart> coarse_start(const ChannelProblem& problem,
                                              const Block& coarse,
                                              const InverseOptions& options,
                                              const std::optional<ChannelSolver::WarmStart>& from,
                                              bool try_rivals,
                                              diffusion::FluenceSolver& solver,
                                              const Clock& clock,
                                              std::stop_token stop);

}  // namespace opaline::reconstruct
