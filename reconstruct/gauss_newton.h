#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "reconstruct/lbfgs.h"

namespace opaline::reconstruct {

/// H v, H symmetric and positive semidefinite: Gauss-Newton's second derivative of the objective at a point.
using HessianProduct = std::function<Result<std::vector<double>>(std::span<const double> v,
                                                                 const std::stop_token& stop)>;

struct GaussNewtonOptions {
  int products = 20;          ///< H v in one step at most; >= 1
  double largest_move = 1.0;  ///< of any parameter in one step; > 0
  int evaluations = 8;        ///< of a line search; >= 1
};

/// One step of inexact Gauss-Newton: conjugate gradients on H d = -g over the parameters that no bound holds, until
/// ||H d + g|| <= eta ||g|| with the forcing term of Eisenstat & Walker (SIAM J. Sci. Comput. 17, 16 (1996), choice 2),
///
///   eta_k = 0.9 (||g_k|| / ||g_(k-1)||)^2,   within [0.05, 0.5],   eta_0 = 0.5,
///
/// or until CG finds no curvature (Steihaug 1983); then the first of d, d/2, d/4, ... along P(x + alpha d) with a
/// sufficient decrease (Bertsekas' active set, as lbfgs_step). state.pairs keeps the last move and change of gradient:
/// all that the next step depends on besides x.
///
/// Errors: the objective's and the product's; the state is unchanged then.
Result<StepOutcome> gauss_newton_step(LbfgsState& state,
                                      const Bounds& bounds,
                                      const GaussNewtonOptions& options,
                                      const ObjectiveFunction& objective,
                                      const HessianProduct& product,
                                      std::stop_token stop);

}  // namespace opaline::reconstruct
