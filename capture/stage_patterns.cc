#include "capture/stage_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "capture/cholesky.h"

namespace opaline::capture {
namespace {

using std::numbers::pi;

constexpr double kDamping = 1e-6;
constexpr double kLeastWeight = 0.2;  // over the mean
constexpr double kMostWeight = 3.0;

/// sum_(l <= degree) (2 l + 1)/(4 pi) P_l(x)
double kernel(double x, int degree) {
  double before = 1.0;
  double now = x;
  double sum = 1.0 + (degree > 0 ? 3.0 * x : 0.0);
  for (int l = 2; l <= degree; ++l) {
    const double next = ((2.0 * l - 1.0) * x * now - (l - 1.0) * before) / l;
    before = now;
    now = next;
    sum += (2.0 * l + 1.0) * now;
  }
  return sum / (4.0 * pi);
}

std::vector<double> weights_of(std::span<const Vec3> directions, int degree) {
  const std::size_t n = directions.size();
  const double even = 4.0 * pi / static_cast<double>(n);
  std::vector<double> matrix(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      matrix[i * n + j] =
          kernel(dot(directions[i], directions[j]), degree) + (i == j ? kDamping : 0.0);
  return solve_cholesky(matrix, std::vector<double>(n, 1.0 + kDamping * even));
}

std::uint8_t code_of(double level) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(level, 0.0, 1.0)));
}

}  // namespace

SphereWeights sphere_weights(std::span<const Vec3> directions) {
  const auto count = static_cast<double>(directions.size());
  for (int degree = static_cast<int>(std::sqrt(count) / 2.0);; --degree) {
    std::vector<double> weights = weights_of(directions, degree);
    const auto [least, most] = std::ranges::minmax(weights);
    const double mean = 4.0 * pi / count;
    if (degree == 0 || (least >= kLeastWeight * mean && most <= kMostWeight * mean))
      return {std::move(weights), degree};
  }
}

Result<std::vector<StageLight>> stage_patterns(std::span<const SphereLight> lights,
                                               const std::array<Vec3, 3>& axes,
                                               const StagePatternOptions& options) {
  std::vector<std::size_t> working;
  std::vector<Vec3> directions;
  for (std::size_t n = 0; n < lights.size(); ++n) {
    if (!(lights[n].intensity > 0.0)) continue;
    if (!(length(lights[n].position) > 0.0))
      return invalid_argument(fmt::format("light {} is in the middle of the sphere", n));
    working.push_back(n);
    directions.push_back(normalized(lights[n].position));
  }
  if (working.size() < 12)
    return invalid_argument(fmt::format("{} working lights; expected at least 12", working.size()));
  const SphereWeights even = sphere_weights(directions);
  std::vector<double> levels(lights.size(), 0.0);  // of the constant pattern, brightest 1
  for (std::size_t n = 0; n < working.size(); ++n) {
    const SphereLight& light = lights[working[n]];
    levels[working[n]] = even.weights[n] * dot(light.position, light.position) / light.intensity;
  }
  const double brightest = std::ranges::max(levels);
  for (double& level : levels) level /= brightest;

  std::vector<StageLight> patterns;
  const auto add = [&](std::string name, const std::function<double(Vec3)>& share) {
    StageLight pattern{std::move(name), std::vector<std::uint8_t>(lights.size(), 0)};
    for (std::size_t n = 0; n < working.size(); ++n)
      pattern.codes[working[n]] = code_of(levels[working[n]] * share(directions[n]));
    patterns.push_back(std::move(pattern));
  };
  const auto constant = [](Vec3) { return 1.0; };
  add("constant", constant);
  for (std::size_t a = 0; a < 3; ++a) {
    const Vec3 axis = axes[a];
    const std::string name = fmt::format("gradient_{}", "xyz"[a]);
    if (!options.split) {
      add(name, [&](Vec3 way) { return 0.5 * (1.0 + dot(way, axis)); });
      continue;
    }
    add(name + "_plus", [&](Vec3 way) { return std::max(0.0, dot(way, axis)); });
    add(name + "_minus", [&](Vec3 way) { return std::max(0.0, -dot(way, axis)); });
  }
  if (options.specular) {
    add("constant_parallel", constant);
    patterns.back().parallel = true;
  }
  add("constant_again", constant);
  return patterns;
}

StageLight beam_alone(std::size_t lights) {
  StageLight beam{"beam", std::vector<std::uint8_t>(lights, 0)};
  beam.codes.back() = 255;
  return beam;
}

double mean_radiance(std::span<const SphereLight> lights, std::span<const std::uint8_t> codes) {
  double sum = 0.0;
  for (std::size_t n = 0; n < lights.size(); ++n)
    sum += codes[n] / 255.0 * lights[n].intensity / dot(lights[n].position, lights[n].position);
  return sum / (4.0 * pi);
}

}  // namespace opaline::capture
