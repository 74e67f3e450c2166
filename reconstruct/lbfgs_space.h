#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <stop_token>
#include <vector>

#include "base/result.h"

namespace opaline::reconstruct {

/// s.s', s.y', y.s', y.y' of a curvature pair (s, y) with those remembered before it: [0] with itself, [n] with the pair
/// n places older. Products with pairs that were forgotten may follow.
using PairProducts = std::vector<std::array<double, 4>>;

/// d = gradient g~ + sum_k (s_k s_k + y_k y_k) on the free parameters, 0 on the held ones, over the remembered pairs,
/// oldest first; shortened where a parameter would move by more than `largest_move`.
struct LbfgsDirection {
  double gradient = -1.0;
  std::vector<double> s;
  std::vector<double> y;
  double largest_move = 0.0;  ///< > 0, or infinite
};

/// Where the vectors of a limited-memory BFGS live, and all that is done with them: what lbfgs_step() needs of the
/// processor's memory or of a device's. Scalars come a few at a time, so that a device is read once an evaluation.
///
/// x is the point, g the objective's gradient there; a parameter is held when it sits at a bound that descent would push
/// it through (Bertsekas 1982), and g~ is g with 0 for those. Attempts at P(x + alpha d), P the projection into the box,
/// leave x as it is until accept().
class LbfgsSpace {
 public:
  virtual ~LbfgsSpace() = default;

  /// g~ and its products with the remembered pairs, oldest first.
  struct FreeGradient {
    double largest = 0.0;  ///< max |g~_i|
    double square = 0.0;   ///< g~ . g~
    std::vector<double> s;
    std::vector<double> y;
  };
  virtual Result<FreeGradient> free_gradient() = 0;

  virtual void set_direction(const LbfgsDirection& direction) = 0;

  struct Attempt {
    double here = 0.0;       ///< the objective at x
    double value = 0.0;      ///< the objective at P(x + alpha d)
    double promised = 0.0;   ///< g . (P(x + alpha d) - x)
    double slope = 0.0;      ///< g . d
    double new_slope = 0.0;  ///< d . the gradient at P(x + alpha d)
    double move = 0.0;       ///< max |d_i|
  };
  virtual Result<Attempt> attempt(double alpha, std::stop_token stop) = 0;
  /// The last attempt is the best so far.
  virtual void keep() = 0;
  /// The best attempt becomes x. Answers the products of its (s, y) = (x' - x, g' - g).
  virtual PairProducts accept() = 0;
  /// That pair is the newest of those remembered, of which there are at most `most`.
  virtual void remember(std::size_t most) = 0;
  virtual void forget_all() = 0;
};

}  // namespace opaline::reconstruct
