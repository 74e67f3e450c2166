#include "reconstruct/spherical_gradient/beam_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

constexpr int kIterations = 200;
constexpr double kStep = 1e-6;  // of the logarithms, for differences
constexpr double kSettled = 1e-10;

double boundary_constant(double ior) {
  const double reflected = diffusion::internal_moments(ior).fluence;
  return (1.0 + reflected) / (1.0 - reflected);
}

double source(double depth, double sigma, double distance) {
  const double d = std::hypot(distance, depth);
  return depth * (1.0 + sigma * d) * std::exp(-sigma * d) / (d * d * d);
}

double dipole(double decay, double diffusion, double a, double distance) {
  const double albedo = 1.0 - decay * decay / 3.0;
  const double sigma = decay / (3.0 * diffusion);
  return albedo / (4.0 * std::numbers::pi) *
         (source(3.0 * diffusion, sigma, distance) +
          source(diffusion * (3.0 + 4.0 * a), sigma, distance));
}

struct Points {
  std::vector<double> distance;
  std::vector<double> log_exitance;
  std::vector<double> root_weight;
  double a = 1.0;
};

using Place = std::array<double, 2>;  // ln D, ln g

std::vector<double> residuals(const Points& p, const Place& at) {
  std::vector<double> r;
  for (std::size_t n = 0; n < p.distance.size(); ++n)
    r.push_back(p.root_weight[n] *
                (std::log(dipole(std::exp(at[1]), std::exp(at[0]), p.a, p.distance[n])) -
                 p.log_exitance[n]));
  return r;
}

double sum_of_squares(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return sum;
}

/// g below sqrt(3), where nothing scatters, and above what a double can tell from 0.
Place kept(Place at) {
  at[1] = std::clamp(at[1], std::log(1e-4), std::log(1.73));
  return at;
}

}  // namespace

double dipole_exitance(double reduced_albedo, double diffusion, double ior, double distance) {
  return dipole(
      std::sqrt(3.0 * (1.0 - reduced_albedo)), diffusion, boundary_constant(ior), distance);
}

Result<BeamParameters> fit_beam(std::span<const double> distance,
                                std::span<const double> exitance,
                                std::span<const double> weight,
                                double ior) {
  if (distance.size() != exitance.size() || distance.size() != weight.size())
    return invalid_argument("beam: distances, exitances and weights of different numbers");
  if (!(ior >= 1.0 && ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", ior));
  Points p{{}, {}, {}, boundary_constant(ior)};
  double weights = 0.0;
  for (std::size_t n = 0; n < distance.size(); ++n) {
    if (!(exitance[n] > 0.0 && weight[n] > 0.0 && distance[n] >= 0.0)) continue;
    p.distance.push_back(distance[n]);
    p.log_exitance.push_back(std::log(exitance[n]));
    p.root_weight.push_back(std::sqrt(weight[n]));
    weights += weight[n];
  }
  if (p.distance.size() < 4)
    return invalid_argument(
        fmt::format("beam: {} points with light; expected at least 4", p.distance.size()));
  Place at{std::log(0.2 * (p.distance.front() + 0.1 * p.distance.back())), std::log(0.4)};
  std::vector<double> r = residuals(p, at);
  double squares = sum_of_squares(r);
  double damping = 1e-3;
  for (int iteration = 1; iteration <= kIterations; ++iteration) {
    std::array<std::vector<double>, 2> slope;
    for (std::size_t k = 0; k < 2; ++k) {
      Place moved = at;
      moved[k] += kStep;
      slope[k] = residuals(p, moved);
      for (std::size_t n = 0; n < r.size(); ++n) slope[k][n] = (slope[k][n] - r[n]) / kStep;
    }
    std::array<double, 3> normal{};  // J^T J: 00, 01, 11
    Place right{};
    for (std::size_t n = 0; n < r.size(); ++n) {
      normal[0] += slope[0][n] * slope[0][n];
      normal[1] += slope[0][n] * slope[1][n];
      normal[2] += slope[1][n] * slope[1][n];
      right[0] -= slope[0][n] * r[n];
      right[1] -= slope[1][n] * r[n];
    }
    const double a = normal[0] * (1.0 + damping);
    const double c = normal[2] * (1.0 + damping);
    const double det = a * c - normal[1] * normal[1];
    const Place next = kept({at[0] + (c * right[0] - normal[1] * right[1]) / det,
                             at[1] + (a * right[1] - normal[1] * right[0]) / det});
    const std::vector<double> trial = residuals(p, next);
    const double better = sum_of_squares(trial);
    const double step = std::abs(next[0] - at[0]) + std::abs(next[1] - at[1]);
    if (better <= squares) {
      at = next;
      r = trial;
      squares = better;
      damping = std::max(1e-9, 0.2 * damping);
    } else {
      damping = std::min(1e9, 5.0 * damping);
    }
    if (step > kSettled) continue;
    const double decay = std::exp(at[1]);
    const double found = std::exp(at[0]);
    return BeamParameters{1.0 - decay * decay / 3.0,
                          found,
                          3.0 * found / decay,
                          std::sqrt(squares / weights),
                          iteration};
  }
  return internal_error("beam: the fit of a dipole does not settle");
}

}  // namespace opaline::reconstruct
