#include "reconstruct/published_step.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace opaline::reconstruct {
namespace {

constexpr int kEvaluations = 14;      // of a line search
constexpr double kGolden = 0.618034;  // (sqrt(5) - 1) / 2
constexpr double kFirstMove = 0.5;    // of the parameter that moves most, relative to itself

double dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// (kappa, sigma_a), all kappa first.
std::vector<double> raw_of(std::span<const double> x) {
  const std::size_t cells = x.size() / 2;
  std::vector<double> raw(x.size());
  for (std::size_t i = 0; i < cells; ++i) {
    raw[cells + i] = std::exp(x[cells + i]);
    raw[i] = 1.0 / (3.0 * (std::exp(x[i]) + raw[cells + i]));
  }
  return raw;
}

// Back, within the bounds.
std::vector<double> logarithms_of(std::span<const double> raw, const Bounds& bounds) {
  const std::size_t cells = raw.size() / 2;
  std::vector<double> x(raw.size());
  const auto bounded = [&](double value, std::size_t i) {
    return value > 0.0 ? std::clamp(std::log(value), bounds.lower[i], bounds.upper[i])
                       : bounds.lower[i];
  };
  for (std::size_t i = 0; i < cells; ++i) {
    const double kappa = std::max(raw[i], 1e-12);
    x[i] = bounded(1.0 / (3.0 * kappa) - std::max(raw[cells + i], 0.0), i);
    x[cells + i] = bounded(raw[cells + i], cells + i);
  }
  return x;
}

// dJ/dkappa at fixed sigma_a and dJ/dsigma_a at fixed kappa from the derivatives by the logarithms of sigma_s' and
// sigma_a: log sigma_s' = log(1 / (3 kappa) - sigma_a).
std::vector<double> raw_gradient(const LbfgsState& state) {
  const std::size_t cells = state.x.size() / 2;
  std::vector<double> g(state.x.size());
  for (std::size_t i = 0; i < cells; ++i) {
    const double scattering = std::exp(state.x[i]);
    const double absorption = std::exp(state.x[cells + i]);
    const double by_scattering = state.at.gradient[i] / scattering;
    const double inverse_kappa = 3.0 * (scattering + absorption);
    g[i] = -by_scattering * inverse_kappa * inverse_kappa / 3.0;
    g[cells + i] = state.at.gradient[cells + i] / absorption - by_scattering;
  }
  return g;
}

std::vector<double> direction(const LbfgsState& state, const std::vector<double>& g) {
  std::vector<double> d(g.size());
  std::transform(g.begin(), g.end(), d.begin(), [](double v) { return -v; });
  if (state.pairs.empty()) return d;
  const CurvaturePair& last = state.pairs.front();
  const double beta = std::max(0.0, (dot(g, g) - dot(g, last.y)) / dot(last.y, last.y));
  for (std::size_t i = 0; i < d.size(); ++i) d[i] += beta * last.s[i];
  if (dot(d, g) < 0.0) return d;
  std::transform(g.begin(), g.end(), d.begin(), [](double v) { return -v; });
  return d;
}

std::vector<double> moved(std::span<const double> raw, double alpha, std::span<const double> d) {
  std::vector<double> there(raw.begin(), raw.end());
  for (std::size_t i = 0; i < there.size(); ++i) there[i] += alpha * d[i];
  return there;
}

// Where the parameter that moves most, relative to itself, has moved by kFirstMove.
double first_length(std::span<const double> raw, std::span<const double> d) {
  double most = 0.0;
  for (std::size_t i = 0; i < raw.size(); ++i) most = std::max(most, std::abs(d[i]) / raw[i]);
  return most > 0.0 ? kFirstMove / most : 0.0;
}

}  // namespace

Result<StepOutcome> published_step(LbfgsState& state,
                                   const Bounds& bounds,
                                   const PublishedObjective& objective,
                                   std::stop_token stop) {
  const std::vector<double> raw = raw_of(state.x);
  const std::vector<double> g = raw_gradient(state);
  const std::vector<double> d = direction(state, g);
  double best = 0.0;
  double least = state.at.value;
  const auto at = [&](double alpha) -> Result<double> {
    auto value = objective.value(logarithms_of(moved(raw, alpha, d), bounds), stop);
    if (value && *value < least) {
      least = *value;
      best = alpha;
    }
    return value;
  };
  double low = 0.0;
  double high = first_length(raw, d) / (kGolden * kGolden);
  double inner = high - kGolden * (high - low);
  double outer = low + kGolden * (high - low);
  auto at_inner = at(inner);
  if (!at_inner) return at_inner.error();
  auto at_outer = at(outer);
  if (!at_outer) return at_outer.error();
  for (int n = 2; n < kEvaluations; ++n) {
    if (*at_inner < *at_outer) {
      high = outer;
      outer = inner;
      at_outer = at_inner;
      inner = high - kGolden * (high - low);
      at_inner = at(inner);
      if (!at_inner) return at_inner.error();
    } else {
      low = inner;
      inner = outer;
      at_inner = at_outer;
      outer = low + kGolden * (high - low);
      at_outer = at(outer);
      if (!at_outer) return at_outer.error();
    }
  }
  if (best == 0.0) {
    if (state.pairs.empty()) return StepOutcome::kNoDescent;
    state.pairs.clear();  // once more along the steepest descent
    return published_step(state, bounds, objective, std::move(stop));
  }
  std::vector<double> x = logarithms_of(moved(raw, best, d), bounds);
  auto there = objective.evaluate(x, std::move(stop));
  if (!there) return there.error();
  state.x = std::move(x);
  state.at = *std::move(there);
  state.pairs.assign(1, {d, g});
  return StepOutcome::kMoved;
}

}  // namespace opaline::reconstruct
