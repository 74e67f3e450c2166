#include "sim/ball_transport.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "sim/ball_walk.h"
#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr std::int64_t kBatch = 4096;  // paths, each from its own stratum of the cosine

struct Sums {
  double constant = 0.0;
  double gradient = 0.0;
  double aside = 0.0;  // towards the camera, times the sine of its angle
  double along = 0.0;  // along the normal, times the sine's square
};

class Tracer {
 public:
  explicit Tracer(const Ball& ball) : ball_(ball), walk_(ball) {}

  /// One path that enters at the pole from a direction of this cosine.
  void trace(double cosine, PathNumbers& numbers, Sums& sums) const {
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const Vec3 light{sine, 0.0, cosine};
    const double bent = sine / ball_.ior;
    const auto exit = walk_.walk({0.0, 0.0, ball_.radius},
                                 {-bent, 0.0, -std::sqrt(1.0 - bent * bent)},
                                 1.0 - reflectance(cosine, 1.0, ball_.ior),
                                 numbers);
    if (!exit || exit->collisions < 2) return;
    sums.constant += exit->weight;
    sums.gradient += exit->weight * dot(light, exit->normal);
    // Snell: the sine outside is the index times that inside, which is the length of what goes across
    const Vec3 across = (exit->way - exit->normal * exit->cosine_inside) * ball_.ior;
    sums.aside += exit->weight * dot(light, across);
    sums.along += exit->weight * dot(light, exit->normal) * dot(across, across);
  }

 private:
  Ball ball_;
  BallWalk walk_;
};

BallLight summary(const std::vector<Sums>& batches) {
  const auto count = static_cast<double>(batches.size());
  Sums mean;
  for (const Sums& batch : batches) {
    mean.constant += batch.constant / count;
    mean.gradient += batch.gradient / count;
    mean.aside += batch.aside / count;
    mean.along += batch.along / count;
  }
  BallLight light{
      mean.constant / kBatch, 0.0, mean.constant / mean.gradient, 0.0, -mean.aside / mean.along};
  double spread = 0.0;
  double ratio_spread = 0.0;
  for (const Sums& batch : batches) {
    const double off = batch.constant - mean.constant;
    spread += off * off;
    const double residual = batch.constant - light.ratio * batch.gradient;
    ratio_spread += residual * residual;
  }
  const double scale = 1.0 / std::sqrt(count * (count - 1.0));
  light.reflectance_deviation = std::sqrt(spread) * scale / kBatch;
  light.ratio_deviation = std::sqrt(ratio_spread) * scale / mean.gradient;
  return light;
}

}  // namespace

Result<void> check(const Ball& ball) {
  if (!(ball.reduced_albedo >= 0.0 && ball.reduced_albedo < 1.0))
    return invalid_argument(
        fmt::format("reduced albedo {}; expected 0 to below 1", ball.reduced_albedo));
  if (!(ball.radius >= 1.0 && ball.radius <= 1e6))
    return invalid_argument(
        fmt::format("radius of {} mean free paths; expected 1 to 1e6", ball.radius));
  if (!(ball.ior >= 1.0 && ball.ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", ball.ior));
  return ok();
}

Result<BallLight> trace_ball(const Ball& ball,
                             std::int64_t paths,
                             std::uint64_t seed,
                             ThreadTeam& team) {
  if (Result<void> good = check(ball); !good) return good.error();
  if (paths < 2 * kBatch || paths > std::int64_t{1} << 40U)
    return invalid_argument(fmt::format("{} paths; expected at least {}", paths, 2 * kBatch));
  const Tracer tracer(ball);
  std::vector<Sums> batches(static_cast<std::size_t>((paths + kBatch - 1) / kBatch));
  team.run([&](int thread) {
    for (std::size_t b = thread; b < batches.size(); b += team.size()) {
      PathNumbers numbers(seed * 0x2545f4914f6cdd1dULL + b * 0xd1342543de82ef95ULL);
      Sums sums;
      for (std::int64_t n = 0; n < kBatch; ++n) {
        const double share = (static_cast<double>(n) + numbers.next()) / kBatch;
        tracer.trace(std::sqrt(share), numbers, sums);
      }
      batches[b] = sums;
    }
  });
  return summary(batches);
}

}  // namespace opaline::sim
