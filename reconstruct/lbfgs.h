#pragma once

#include <deque>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "reconstruct/evaluation.h"
#include "reconstruct/lbfgs_space.h"

namespace opaline::reconstruct {

/// Box of a minimisation, one interval a parameter.
struct Bounds {
  std::vector<double> lower;
  std::vector<double> upper;
};

/// s = x_(k+1) - x_k and y = g_(k+1) - g_k.
struct CurvaturePair {
  std::vector<double> s;
  std::vector<double> y;
};

/// Where a minimisation stands: all that the next step depends on.
struct LbfgsState {
  std::vector<double> x;
  Evaluation at;                      ///< the objective at x
  std::deque<CurvaturePair> pairs;    ///< oldest first
  std::deque<PairProducts> products;  ///< of the pairs; made afresh where there are not as many
};

struct LbfgsOptions {
  int memory = 12;            ///< curvature pairs kept; >= 1
  double largest_move = 1.0;  ///< of any parameter in one step; > 0
  double first_move =
      0.2;  ///< of the parameter that moves most, while nothing is known of the curvature; > 0
  int evaluations = 12;  ///< a line search's own; >= 1
};

enum class StepOutcome : std::uint8_t {
  kMoved,
  kNoDescent,  ///< no lower value along the steepest descent: a minimum, to the accuracy of the
               ///< objective
};

using ObjectiveFunction =
    std::function<Result<Evaluation>(std::span<const double> x, std::stop_token stop)>;

/// One step of projected limited-memory BFGS (Nocedal 1980; Nocedal & Wright, Numerical
/// Optimization, alg. 7.4), with bounds after Bertsekas (SIAM J. Control Optim. 20, 221 (1982)):
/// parameters at a bound whose gradient points outwards are left out of the two-loop recursion, the
/// rest moves along P(x + alpha d). The line search asks for sufficient decrease (Armijo) by
/// safeguarded cubic interpolation and goes further while the curvature condition of Wolfe fails.
/// Value and gradient come from one evaluation; a step usually takes one.
///
/// The recursion runs on the products of the vectors (Chen, Wang & Zhou, Large-scale L-BFGS using MapReduce, NIPS 2014,
/// alg. 3), so that it touches no vector: the step is the same wherever they live.
///
/// `products` are those of the pairs that the space remembers.
/// Errors: the space's; it stays at x then.
Result<StepOutcome> lbfgs_step(LbfgsSpace& space,
                               std::deque<PairProducts>& products,
                               const LbfgsOptions& options,
                               const std::stop_token& stop);

/// The same on vectors in the processor's memory. Errors: the objective's; the state is unchanged then.
Result<StepOutcome> lbfgs_step(LbfgsState& state,
                               const Bounds& bounds,
                               const LbfgsOptions& options,
                               const ObjectiveFunction& objective,
                               std::stop_token stop);

}  // namespace opaline::reconstruct
