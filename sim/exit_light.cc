#include "sim/exit_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/ball_walk.h"
#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr std::int64_t kExitBatch = 4096;  // paths, each from its own stratum of the cosine

/// Of one batch and bin: light, times the cosine to the camera, and the gradient along the normal and away from it towards the camera.
struct ExitSums {
  double constant = 0.0;
  double cosine = 0.0;
  double along = 0.0;
  double aside = 0.0;
};

void trace_path(const BallWalk& walk,
                const Ball& ball,
                std::span<const double> edges,
                double cosine,
                PathNumbers& numbers,
                std::span<ExitSums> bins) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  const Vec3 light{sine, 0.0, cosine};
  const double bent = sine / ball.ior;
  const auto exit = walk.walk({0.0, 0.0, ball.radius},
                              {-bent, 0.0, -std::sqrt(1.0 - bent * bent)},
                              1.0 - reflectance(cosine, 1.0, ball.ior),
                              numbers);
  if (!exit || exit->collisions < 2) return;
  const Vec3 across = exit->way - exit->normal * exit->cosine_inside;
  const double inside = length(across);
  const double out = std::min(1.0, ball.ior * inside);
  const double square = 1.0 - out * out;  // of the cosine outside
  const auto bin =
      static_cast<std::size_t>(std::ranges::upper_bound(edges, square) - edges.begin());
  if (bin == 0 || bin > bins.size()) return;
  ExitSums& sums = bins[bin - 1];
  sums.constant += exit->weight;
  sums.cosine += exit->weight * std::sqrt(square);
  sums.along += exit->weight * dot(light, exit->normal);
  if (inside > 0.0) sums.aside += exit->weight * dot(light, across) / inside;
}

ExitLight exit_summary(std::span<const std::vector<ExitSums>> batches,
                       std::size_t bin,
                       double share) {
  const auto count = static_cast<double>(batches.size());
  ExitSums mean;
  for (const auto& batch : batches) {
    mean.constant += batch[bin].constant / count;
    mean.cosine += batch[bin].cosine / count;
    mean.along += batch[bin].along / count;
    mean.aside += batch[bin].aside / count;
  }
  const double gradient = std::hypot(mean.along, mean.aside);
  ExitLight light;
  light.cosine = mean.cosine / mean.constant;
  light.reflectance = mean.constant / (kExitBatch * share);
  light.ratio = mean.constant / gradient;
  light.tilt = -std::atan2(mean.aside, mean.along);
  double spread = 0.0;
  double ratio_spread = 0.0;
  double tilt_spread = 0.0;
  for (const auto& batch : batches) {
    const ExitSums& b = batch[bin];
    spread += std::pow(b.constant - mean.constant, 2);
    const double length = (b.along * mean.along + b.aside * mean.aside) / gradient;
    ratio_spread += std::pow(b.constant - light.ratio * length, 2);
    tilt_spread += std::pow((b.aside * mean.along - b.along * mean.aside) / gradient, 2);
  }
  const double scale = 1.0 / std::sqrt(count * (count - 1.0));
  light.reflectance_deviation = std::sqrt(spread) * scale / (kExitBatch * share);
  light.ratio_deviation = std::sqrt(ratio_spread) * scale / gradient;
  light.tilt_deviation = std::sqrt(tilt_spread) * scale / gradient;
  return light;
}

}  // namespace

Result<std::vector<ExitLight>> trace_exit_light(const Ball& ball,
                                                std::span<const double> edges,
                                                std::int64_t paths,
                                                std::uint64_t seed,
                                                ThreadTeam& team) {
  if (auto good = check(ball); !good) return good.error();
  if (edges.size() < 2 || edges.front() < 0.0 || edges.back() > 1.0 ||
      std::ranges::adjacent_find(edges, std::greater_equal<>()) != edges.end() ||
      paths < 2 * kExitBatch)
    return invalid_argument(
        fmt::format("exit light: {} edges and {} paths; expected rising ones from 0 to 1, and at "
                    "least {} paths",
                    edges.size(),
                    paths,
                    2 * kExitBatch));
  const BallWalk walk(ball);
  const std::size_t bins = edges.size() - 1;
  std::vector<std::vector<ExitSums>> batches(
      static_cast<std::size_t>((paths + kExitBatch - 1) / kExitBatch));
  team.run([&](int thread) {
    for (std::size_t b = static_cast<std::size_t>(thread); b < batches.size();
         b += static_cast<std::size_t>(team.size())) {
      PathNumbers numbers(seed * 0x2545f4914f6cdd1dULL + b * 0xd1342543de82ef95ULL);
      batches[b].resize(bins);
      for (std::int64_t n = 0; n < kExitBatch; ++n) {
        const double share = (static_cast<double>(n) + numbers.next()) / kExitBatch;
        trace_path(walk, ball, edges, std::sqrt(share), numbers, batches[b]);
      }
    }
  });
  std::vector<ExitLight> lights;
  for (std::size_t bin = 0; bin < bins; ++bin)
    lights.push_back(exit_summary(batches, bin, edges[bin + 1] - edges[bin]));
  return lights;
}

}  // namespace opaline::sim
