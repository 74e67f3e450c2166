#include "reconstruct/lbfgs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/ensure.h"
#include "reconstruct/lbfgs_host_space.h"

namespace opaline::reconstruct {
namespace {

constexpr double kSufficientDecrease = 1e-4;  // Nocedal & Wright, sec. 3.1
constexpr double kCurvature = 0.9;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using FreeGradient = LbfgsSpace::FreeGradient;
using Attempt = LbfgsSpace::Attempt;

enum Product : std::size_t { kSS, kSY, kYS, kYY };

// Products of pairs i and j, whichever is older.
double product(const std::deque<PairProducts>& pairs, std::size_t i, std::size_t j, Product which) {
  if (i >= j) return pairs[i][i - j][which];
  const Product swapped = which == kSY ? kYS : which == kYS ? kSY : which;
  return pairs[j][j - i][swapped];
}

// A combination of g~ and the pairs, and its products with the pairs and g~.
class Combination {
 public:
  Combination(const FreeGradient& g, const std::deque<PairProducts>& pairs)
      : g_(g), pairs_(pairs), c_{-1.0, {}, {}, kInfinity} {
    c_.s.assign(pairs.size(), 0.0);
    c_.y.assign(pairs.size(), 0.0);
  }
  double dot_s(std::size_t k) const {
    double sum = c_.gradient * g_.s[k];
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      sum += c_.s[i] * product(pairs_, i, k, kSS) + c_.y[i] * product(pairs_, i, k, kYS);
    return sum;
  }
  double dot_y(std::size_t k) const {
    double sum = c_.gradient * g_.y[k];
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      sum += c_.s[i] * product(pairs_, i, k, kSY) + c_.y[i] * product(pairs_, i, k, kYY);
    return sum;
  }
  double dot_gradient() const {
    double sum = c_.gradient * g_.square;
    for (std::size_t i = 0; i < pairs_.size(); ++i) sum += c_.s[i] * g_.s[i] + c_.y[i] * g_.y[i];
    return sum;
  }
  void add_s(std::size_t k, double factor) { c_.s[k] += factor; }
  void add_y(std::size_t k, double factor) { c_.y[k] += factor; }
  void scale(double factor) {
    c_.gradient *= factor;
    for (double& v : c_.y) v *= factor;
  }
  const LbfgsDirection& coefficients() const { return c_; }

 private:
  const FreeGradient& g_;
  const std::deque<PairProducts>& pairs_;
  LbfgsDirection c_;
};

// -H g~ by the two-loop recursion; H_0 = (s y / y y) I of the newest pair.
Combination quasi_newton(const FreeGradient& g, const std::deque<PairProducts>& pairs) {
  Combination d(g, pairs);
  std::vector<double> alpha(pairs.size());
  for (std::size_t k = pairs.size(); k-- > 0;) {
    alpha[k] = d.dot_s(k) / pairs[k][0][kSY];
    d.add_y(k, -alpha[k]);
  }
  d.scale(pairs.back()[0][kSY] / pairs.back()[0][kYY]);
  for (std::size_t k = 0; k < pairs.size(); ++k)
    d.add_s(k, alpha[k] - d.dot_y(k) / pairs[k][0][kSY]);
  return d;
}

// The step to try: -H g~, or steepest descent when nothing is known or H g~ does not descend.
LbfgsDirection direction(const FreeGradient& g,
                         LbfgsSpace& space,
                         std::deque<PairProducts>& pairs,
                         const LbfgsOptions& options) {
  if (!pairs.empty()) {
    const Combination d = quasi_newton(g, pairs);
    if (d.dot_gradient() < 0.0) {
      LbfgsDirection step = d.coefficients();
      step.largest_move = options.largest_move;
      return step;
    }
    pairs.clear();
    space.forget_all();
  }
  return {-options.first_move / g.largest, {}, {}, kInfinity};
}

// The minimum of the cubic through values and slopes at 0 and alpha (Nocedal & Wright, Eq. 3.59),
// kept within a tenth and a half of alpha.
double interpolate(double alpha, const Attempt& a) {
  const double d1 = a.slope + a.new_slope - 3.0 * (a.value - a.here) / alpha;
  const double discriminant = d1 * d1 - a.slope * a.new_slope;
  double best = 0.5 * alpha;
  if (discriminant >= 0.0) {
    const double d2 = std::sqrt(discriminant);
    const double cubic =
        alpha * (1.0 - (a.new_slope + d2 - d1) / (a.new_slope - a.slope + 2.0 * d2));
    if (std::isfinite(cubic)) best = cubic;
  }
  return std::clamp(best, 0.1 * alpha, 0.5 * alpha);
}

bool decreases_enough(const Attempt& a) {
  return a.value < a.here && a.value <= a.here + kSufficientDecrease * a.promised;
}

// Follows P(x + alpha d) to a sufficient decrease; whether there is one.
Result<bool> search(LbfgsSpace& space, const LbfgsOptions& options, const std::stop_token& stop) {
  bool found = false;
  double least = 0.0;
  double alpha = 1.0;
  for (int n = 0; n < options.evaluations; ++n) {
    const auto a = space.attempt(alpha, stop);
    if (!a) return a.error();
    if (!decreases_enough(*a)) {
      if (found) break;  // went further than was good
      alpha = std::isfinite(a->value) ? interpolate(alpha, *a) : 0.1 * alpha;
      continue;
    }
    if (found && a->value >= least) break;
    space.keep();
    found = true;
    least = a->value;
    const bool steep = a->new_slope < kCurvature * a->slope;
    if (!steep || 2.0 * alpha * a->move > options.largest_move) break;
    alpha *= 2.0;
  }
  return found;
}

void accept(LbfgsSpace& space, std::deque<PairProducts>& pairs, const LbfgsOptions& options) {
  PairProducts products = space.accept();
  const auto& own = products.front();
  if (own[kSY] <= 1e-10 * std::sqrt(own[kSS] * own[kYY])) return;
  const auto most = static_cast<std::size_t>(options.memory);
  space.remember(most);
  pairs.push_back(std::move(products));
  if (pairs.size() > most) pairs.pop_front();
}

}  // namespace

Result<StepOutcome> lbfgs_step(LbfgsSpace& space,
                               std::deque<PairProducts>& products,
                               const LbfgsOptions& options,
                               const std::stop_token& stop) {
  for (;;) {
    const auto g = space.free_gradient();
    if (!g) return g.error();
    if (g->largest == 0.0) return StepOutcome::kNoDescent;
    space.set_direction(direction(*g, space, products, options));
    const auto found = search(space, options, stop);
    if (!found) return found.error();
    if (*found) {
      accept(space, products, options);
      return StepOutcome::kMoved;
    }
    if (products.empty()) return StepOutcome::kNoDescent;
    products.clear();  // the curvature misled: once more along the steepest descent
    space.forget_all();
  }
}

Result<StepOutcome> lbfgs_step(LbfgsState& state,
                               const Bounds& bounds,
                               const LbfgsOptions& options,
                               const ObjectiveFunction& objective,
                               std::stop_token stop) {
  ENSURE(state.x.size() == bounds.lower.size() && state.x.size() == state.at.gradient.size());
  HostSpace space(state, bounds, objective);
  return lbfgs_step(space, state.products, options, stop);
}

}  // namespace opaline::reconstruct
