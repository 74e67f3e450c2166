#include "reconstruct/lbfgs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr double kSufficientDecrease = 1e-4;  // Nocedal & Wright, sec. 3.1
constexpr double kCurvature = 0.9;

double dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double largest(std::span<const double> a) {
  double m = 0.0;
  for (const double v : a) m = std::max(m, std::abs(v));
  return m;
}

// Whether a parameter sits at a bound that descent would push it through.
bool held(const LbfgsState& state, const Bounds& bounds, std::size_t i) {
  return (state.x[i] <= bounds.lower[i] && state.at.gradient[i] > 0.0) ||
         (state.x[i] >= bounds.upper[i] && state.at.gradient[i] < 0.0);
}

std::vector<double> free_gradient(const LbfgsState& state, const Bounds& bounds) {
  std::vector<double> g = state.at.gradient;
  for (std::size_t i = 0; i < g.size(); ++i) {
    if (held(state, bounds, i)) g[i] = 0.0;
  }
  return g;
}

void add(std::span<double> target, double factor, std::span<const double> source) {
  for (std::size_t i = 0; i < target.size(); ++i) target[i] += factor * source[i];
}

// H g by the two-loop recursion, in place; H_0 = (s y / y y) I of the newest pair.
void multiply_inverse_hessian(const std::deque<CurvaturePair>& pairs, std::vector<double>& g) {
  std::vector<double> alpha(pairs.size());
  for (std::size_t k = pairs.size(); k-- > 0;) {
    alpha[k] = dot(pairs[k].s, g) / dot(pairs[k].s, pairs[k].y);
    add(g, -alpha[k], pairs[k].y);
  }
  const CurvaturePair& newest = pairs.back();
  const double scale = dot(newest.s, newest.y) / dot(newest.y, newest.y);
  for (double& v : g) v *= scale;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double beta = dot(pairs[k].y, g) / dot(pairs[k].s, pairs[k].y);
    add(g, alpha[k] - beta, pairs[k].s);
  }
}

std::vector<double> negated(std::vector<double> g) {
  for (double& v : g) v = -v;
  return g;
}

// The step to try: -H g on the free parameters, or steepest descent when nothing is known or H g
// does not descend.
std::vector<double> direction(LbfgsState& state,
                              const Bounds& bounds,
                              const LbfgsOptions& options) {
  const std::vector<double> g = free_gradient(state, bounds);
  if (!state.pairs.empty()) {
    std::vector<double> d = g;
    multiply_inverse_hessian(state.pairs, d);
    for (std::size_t i = 0; i < d.size(); ++i) d[i] = g[i] == 0.0 ? 0.0 : -d[i];
    if (dot(d, g) < 0.0) {
      const double move = largest(d);
      if (move > options.largest_move) {
        for (double& v : d) v *= options.largest_move / move;
      }
      return d;
    }
    state.pairs.clear();
  }
  std::vector<double> d = negated(g);
  const double move = largest(d);
  if (move > 0.0) {
    for (double& v : d) v *= options.first_move / move;
  }
  return d;
}

std::vector<double> projected(std::span<const double> x,
                              double alpha,
                              std::span<const double> d,
                              const Bounds& bounds) {
  std::vector<double> moved(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    moved[i] = std::clamp(x[i] + alpha * d[i], bounds.lower[i], bounds.upper[i]);
  }
  return moved;
}

// The minimum of the cubic through values and slopes at 0 and alpha (Nocedal & Wright, Eq. 3.59),
// kept within a tenth and a half of alpha.
double interpolate(double alpha, double f0, double slope0, double f1, double slope1) {
  const double d1 = slope0 + slope1 - 3.0 * (f1 - f0) / alpha;
  const double discriminant = d1 * d1 - slope0 * slope1;
  double best = 0.5 * alpha;
  if (discriminant >= 0.0) {
    const double d2 = std::sqrt(discriminant);
    const double cubic = alpha * (1.0 - (slope1 + d2 - d1) / (slope1 - slope0 + 2.0 * d2));
    if (std::isfinite(cubic)) best = cubic;
  }
  return std::clamp(best, 0.1 * alpha, 0.5 * alpha);
}

struct Trial {
  double alpha = 0.0;
  std::vector<double> x;
  Evaluation at;
};

// Follows P(x + alpha d) to a sufficient decrease; kNoDescent leaves `best` untouched.
Result<StepOutcome> search(const LbfgsState& state,
                           const std::vector<double>& d,
                           const Bounds& bounds,
                           const LbfgsOptions& options,
                           const ObjectiveFunction& objective,
                           std::stop_token stop,
                           Trial& best) {
  const double slope = dot(state.at.gradient, d);
  bool found = false;
  double alpha = 1.0;
  for (int n = 0; n < options.evaluations; ++n) {
    Trial trial{alpha, projected(state.x, alpha, d, bounds), {}};
    auto at = objective(trial.x, stop);
    if (!at) return at.error();
    trial.at = *std::move(at);
    double promised = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      promised += state.at.gradient[i] * (trial.x[i] - state.x[i]);
    }
    const bool enough = trial.at.value < state.at.value &&
                        trial.at.value <= state.at.value + kSufficientDecrease * promised;
    const double new_slope = dot(trial.at.gradient, d);
    if (!enough) {
      if (found) break;  // went further than was good
      alpha = std::isfinite(trial.at.value)
                  ? interpolate(alpha, state.at.value, slope, trial.at.value, new_slope)
                  : 0.1 * alpha;
      continue;
    }
    if (found && trial.at.value >= best.at.value) break;
    best = std::move(trial);
    found = true;
    const bool steep = new_slope < kCurvature * slope;
    if (!steep || 2.0 * alpha * largest(d) > options.largest_move) break;
    alpha *= 2.0;
  }
  return found ? StepOutcome::kMoved : StepOutcome::kNoDescent;
}

void remember(LbfgsState& state, const Trial& next, const LbfgsOptions& options) {
  CurvaturePair pair{next.x, next.at.gradient};
  add(pair.s, -1.0, state.x);
  add(pair.y, -1.0, state.at.gradient);
  if (dot(pair.s, pair.y) <= 1e-10 * std::sqrt(dot(pair.s, pair.s) * dot(pair.y, pair.y))) return;
  state.pairs.push_back(std::move(pair));
  if (state.pairs.size() > static_cast<std::size_t>(options.memory)) state.pairs.pop_front();
}

}  // namespace

Result<StepOutcome> lbfgs_step(LbfgsState& state,
                               const Bounds& bounds,
                               const LbfgsOptions& options,
                               const ObjectiveFunction& objective,
                               std::stop_token stop) {
  ENSURE(state.x.size() == bounds.lower.size() && state.x.size() == state.at.gradient.size());
  for (;;) {
    const std::vector<double> d = direction(state, bounds, options);
    if (largest(d) == 0.0) return StepOutcome::kNoDescent;
    Trial next;
    const auto outcome = search(state, d, bounds, options, objective, stop, next);
    if (!outcome) return outcome.error();
    if (*outcome == StepOutcome::kMoved) {
      remember(state, next, options);
      state.x = std::move(next.x);
      state.at = std::move(next.at);
      return StepOutcome::kMoved;
    }
    if (state.pairs.empty()) return StepOutcome::kNoDescent;
    state.pairs.clear();  // the curvature misled: once more along the steepest descent
  }
}

}  // namespace opaline::reconstruct
