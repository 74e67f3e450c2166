#include "reconstruct/gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr double kSufficientDecrease = 1e-4;
constexpr double kLoosest = 0.5;
constexpr double kTightest = 0.05;

double dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double norm(std::span<const double> a) { return std::sqrt(dot(a, a)); }

void add(std::span<double> target, double factor, std::span<const double> source) {
  for (std::size_t i = 0; i < target.size(); ++i) target[i] += factor * source[i];
}

std::vector<bool> held_parameters(const LbfgsState& state, const Bounds& bounds) {
  std::vector<bool> held(state.x.size());
  for (std::size_t i = 0; i < held.size(); ++i) {
    const double g = state.at.gradient[i];
    held[i] =
        (state.x[i] <= bounds.lower[i] && g > 0.0) || (state.x[i] >= bounds.upper[i] && g < 0.0);
  }
  return held;
}

void clear_held(const std::vector<bool>& held, std::span<double> v) {
  for (std::size_t i = 0; i < v.size(); ++i)
    if (held[i]) v[i] = 0.0;
}

double forcing_term(const LbfgsState& state, const std::vector<bool>& held, double size) {
  if (state.pairs.empty()) return kLoosest;
  std::vector<double> before = state.at.gradient;
  add(before, -1.0, state.pairs.back().y);
  clear_held(held, before);
  const double ratio = size / std::max(norm(before), 1e-300);
  return std::clamp(0.9 * ratio * ratio, kTightest, kLoosest);
}

// Conjugate gradients from d = 0 on the free parameters.
Result<std::vector<double>> newton_direction(const LbfgsState& state,
                                             const std::vector<bool>& held,
                                             const GaussNewtonOptions& options,
                                             const HessianProduct& product,
                                             const std::stop_token& stop) {
  std::vector<double> r = state.at.gradient;
  for (double& v : r) v = -v;
  clear_held(held, r);
  const double size = norm(r);
  const double enough = forcing_term(state, held, size) * size;
  std::vector<double> d(r.size(), 0.0);
  std::vector<double> p = r;
  double square = size * size;
  for (int n = 0; n < options.products && std::sqrt(square) > enough; ++n) {
    auto hp = product(p, stop);
    if (!hp) return hp.error();
    clear_held(held, *hp);
    const double curvature = dot(p, *hp);
    if (!(curvature > 0.0)) break;
    const double alpha = square / curvature;
    add(d, alpha, p);
    add(r, -alpha, *hp);
    const double next = dot(r, r);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = r[i] + next / square * p[i];
    square = next;
  }
  if (norm(d) == 0.0) return r;  // no curvature at all: steepest descent
  return d;
}

void limit(std::vector<double>& d, double largest_move) {
  double largest = 0.0;
  for (const double v : d) largest = std::max(largest, std::abs(v));
  if (largest <= largest_move) return;
  for (double& v : d) v *= largest_move / largest;
}

}  // namespace

Result<StepOutcome> gauss_newton_step(LbfgsState& state,
                                      const Bounds& bounds,
                                      const GaussNewtonOptions& options,
                                      const ObjectiveFunction& objective,
                                      const HessianProduct& product,
                                      std::stop_token stop) {
  ENSURE(state.x.size() == bounds.lower.size() && state.x.size() == state.at.gradient.size());
  const std::vector<bool> held = held_parameters(state, bounds);
  auto d = newton_direction(state, held, options, product, stop);
  if (!d) return d.error();
  limit(*d, options.largest_move);
  double alpha = 1.0;
  for (int n = 0; n < options.evaluations; ++n, alpha *= 0.5) {
    std::vector<double> x(state.x.size());
    double promised = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = std::clamp(state.x[i] + alpha * (*d)[i], bounds.lower[i], bounds.upper[i]);
      promised += state.at.gradient[i] * (x[i] - state.x[i]);
    }
    auto at = objective(x, stop);
    if (!at) return at.error();
    if (!(at->value < state.at.value &&
          at->value <= state.at.value + kSufficientDecrease * promised))
      continue;
    CurvaturePair last{x, at->gradient};
    add(last.s, -1.0, state.x);
    add(last.y, -1.0, state.at.gradient);
    state.pairs.clear();
    state.pairs.push_back(std::move(last));
    state.x = std::move(x);
    state.at = *std::move(at);
    return StepOutcome::kMoved;
  }
  return StepOutcome::kNoDescent;
}

}  // namespace opaline::reconstruct
