#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <stop_token>

#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/passes.h"

namespace opaline::reconstruct::diffusion {

/// One symmetric V(1,1)-cycle from zero: z = B r on level 0, and rho = r . z.
template <DiffusionPasses P>
void v_cycle(P& passes) {
  const int last = passes.levels() - 1;
  for (int level = 0; level < last; ++level) passes.smooth_restrict(level);
  for (int level = last; level >= 0; --level) passes.prolong_smooth(level);
}

/// The largest sqrt(norms / references) over the right-hand sides: infinite where a norm is not a
/// number.
double worst_ratio(std::span<const double> norms, std::span<const double> references);

/// The summary with why the iteration stopped, in words.
SolveSummary summarise(Termination termination, int iterations, double relative_residual);

/// Conjugate gradients preconditioned by one V-cycle, for many right-hand sides at once, each with
/// its own step lengths. (Hestenes & Stiefel 1952; Saad, Iterative Methods for Sparse Linear
/// Systems, 2nd ed., Algorithm 9.1.)
///
/// The working precision may be single: whenever the recurred residual has fallen as far as the
/// passes trust it, and before convergence is believed, it is replaced by b - K x in float64 (van der
/// Vorst & Ye 2000, SIAM J. Sci. Comput. 22, section 3), so the solution reaches float64 accuracy.
///
/// Where a last half-sweep is likely to bring the residual below the tolerance, it takes the place of an iteration
/// (passes.finishing()); should it not, conjugate gradients begin anew from there.
///
/// b_norms: ||b||^2 of each right-hand side. A right-hand side of zero must start from x = 0.
/// Returns kBreakdown when three replacements in a row bring no progress or a number stops being
/// one.
template <DiffusionPasses P>
SolveSummary conjugate_gradient(P& passes,
                                std::span<const double> b_norms,
                                const SolveOptions& options,
                                const std::stop_token& stop) {
  double replaced = worst_ratio(passes.true_residual(), b_norms);
  if (replaced <= options.tolerance) replaced = worst_ratio(passes.true_norm(), b_norms);
  if (replaced <= options.tolerance) return summarise(Termination::kConverged, 0, replaced);
  bool restart = true;
  int stalls = 0;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    if (stop.stop_requested()) return summarise(Termination::kCancelled, iteration - 1, replaced);
    v_cycle(passes);
    passes.apply_dot(restart);
    const double recurred = worst_ratio(passes.update_norm(), b_norms);
    if (!std::isfinite(recurred)) return summarise(Termination::kBreakdown, iteration, recurred);
    restart = false;
    const double nearly = passes.finishing() * options.tolerance;
    if (recurred > std::max(nearly, passes.trusted_fall() * replaced)) continue;
    const bool finished = recurred <= nearly;
    if (finished) {
      const double reached = worst_ratio(passes.true_norm(), b_norms);
      if (reached <= options.tolerance)
        return summarise(Termination::kConverged, iteration, reached);
    }
    const double actual = worst_ratio(passes.true_residual(), b_norms);
    stalls = actual > 0.5 * replaced ? stalls + 1 : 0;
    if (stalls == 3) return summarise(Termination::kBreakdown, iteration, actual);
    restart = (finished && passes.finishing() > 1.0) || actual > 2.0 * recurred;
    replaced = actual;
  }
  const double actual = worst_ratio(passes.true_norm(), b_norms);
  return summarise(Termination::kIterationLimit, options.max_iterations, actual);
}

}  // namespace opaline::reconstruct::diffusion
