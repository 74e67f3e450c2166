#pragma once

#include <functional>
#include <span>
#include <stop_token>

#include "base/result.h"
#include "reconstruct/lbfgs.h"

namespace opaline::reconstruct {

/// An objective whose value can be had without its gradient.
struct PublishedObjective {
  ObjectiveFunction evaluate;
  std::function<Result<double>(std::span<const double> x, std::stop_token stop)> value;
};

/// One iteration of the minimisation that Wang 2008 prints (Table I), for comparison only:
/// Polak-Ribiere conjugate gradients in the raw (kappa, sigma_a) with a golden-section line search
/// of 14 evaluations, kept from negative values by the bounds.
///
///   beta = max(0, g . (g - g') / g' . g'),   d = -g + beta d'                (Polak & Ribiere 1969)
///
/// `state` is an LbfgsState, so that all that surrounds it stays the same: x is (log sigma_s',
/// log sigma_a), pairs holds {d', g'} in the raw parameters once there is a last direction.
/// Errors: the objective's; x and the objective there are unchanged then.
Result<StepOutcome> published_step(LbfgsState& state,
                                   const Bounds& bounds,
                                   const PublishedObjective& objective,
                                   std::stop_token stop);

}  // namespace opaline::reconstruct
