#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "reconstruct/reduced_solver.h"

namespace opaline::reconstruct {

/// One setting of the dial between seconds and accuracy.
struct Rung {
  std::string name;  ///< "a quarter of the grid, 2 x 2 regions"
  Reduction reduction;
  InverseOptions options;
};

/// From cheap to dear: the homogeneous sample; a quarter of the grid; half of it; the settings as given; and these run on
/// to convergence. The order is that of the front measured by scripts/bench tradeoff (docs/accuracy.md). What `given` and
/// `options` reduce already is reduced no further than they say.
std::vector<Rung> rungs(const Reduction& given, const InverseOptions& options);

/// What a rung came to.
struct RungReport {
  std::string name;
  double seconds = 0.0;
  RelightingError held_out;
};

/// How the target was gone for.
struct TargetReport {
  double target = 0.0;
  bool reached = false;
  std::vector<RungReport> rungs;  ///< those tried, in order
  std::size_t chosen = 0;         ///< whose material is given
  std::string message;            ///< "reached 3.1 % of the 2 % asked for: ..."
};

struct TargetResult {
  InverseResult result;
  TargetReport report;
};

/// Climbs the rungs until the relighting error of the held-out lights is at most `target`, and gives that rung's
/// material, else that of the rung with the least error. The error is the one that the report shows: with the noise of
/// the held-out pictures in it. Where this noise alone is more than the target no setting can reach it, and only the
/// settings as given are run. The held-out lights choose among few rungs, so their error stays an honest one to about the
/// differences between neighbouring rungs.
///
/// Events: those of reconstruct_material() with {"rung", "rungs"} in each progress;
///         fact "accuracy.measured" {rung, relighting_error, noise_floor, target, seconds, message} after each.
/// Checkpoints: one directory a rung, so an interrupted call repeats no rung that it finished.
/// Errors:  kInvalidArgument for a target that is not above 0 and below 1, or a dataset without held-out lights; those of
///          reconstruct_reduced().
Result<TargetResult> reconstruct_to_target(const Dataset& dataset,
                                           double target,
                                           const Reduction& given,
                                           const InverseOptions& options,
                                           const ReducedContext& context,
                                           std::stop_token stop);

}  // namespace opaline::reconstruct
