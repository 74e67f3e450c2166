#include "sim/ball_transport.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr std::int64_t kBatch = 4096;  // paths, each from its own stratum of the cosine
constexpr double kFaint = 0.05;        // weight below which a path plays for its life
constexpr double kSurvival = 0.25;

struct Vector {
  double x;
  double y;
  double z;
};

double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector along(const Vector& a, double s, const Vector& b) {
  return {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

/// splitmix64 (Steele et al. 2014).
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  double next() {  // in (0, 1)
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    z ^= z >> 31U;
    return (static_cast<double>(z >> 11U) + 0.5) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

Vector isotropic(Numbers& numbers) {
  const double z = 2.0 * numbers.next() - 1.0;
  const double turn = 2.0 * std::numbers::pi * numbers.next();
  const double s = std::sqrt(1.0 - z * z);
  return {s * std::cos(turn), s * std::sin(turn), z};
}

struct Sums {
  double constant = 0.0;
  double gradient = 0.0;
};

class Tracer {
 public:
  explicit Tracer(const Ball& ball) : ball_(ball) {}

  /// One path that enters at the pole from a direction of this cosine.
  void trace(double cosine, Numbers& numbers, Sums& sums) const {
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const Vector light{sine, 0.0, cosine};
    const double bent = sine / ball_.ior;
    Vector at{0.0, 0.0, ball_.radius};
    Vector way{-bent, 0.0, -std::sqrt(1.0 - bent * bent)};
    double weight = 1.0 - reflectance(cosine, 1.0, ball_.ior);
    for (int collisions = 0; weight > 0.0;) {
      const double free = -std::log(numbers.next());
      const double out = to_surface(at, way);
      if (free < out) {
        at = along(at, free, way);
        way = isotropic(numbers);
        weight *= ball_.reduced_albedo;
        ++collisions;
        if (weight < kFaint) weight = numbers.next() < kSurvival ? weight / kSurvival : 0.0;
        continue;
      }
      at = along(at, out, way);
      const double inverse = 1.0 / std::sqrt(dot(at, at));
      const Vector normal{at.x * inverse, at.y * inverse, at.z * inverse};
      const double leaving = std::min(1.0, dot(way, normal));
      if (numbers.next() < reflectance(leaving, ball_.ior, 1.0)) {
        way = along(way, -2.0 * leaving, normal);
        continue;
      }
      if (collisions > 1) {
        sums.constant += weight;
        sums.gradient += weight * dot(light, normal);
      }
      return;
    }
  }

 private:
  double to_surface(const Vector& at, const Vector& way) const {
    const double towards = dot(at, way);
    const double inside = ball_.radius * ball_.radius - dot(at, at);
    const double root = std::sqrt(std::max(0.0, towards * towards + inside));
    return towards > 0.0 ? std::max(0.0, inside) / (root + towards) : root - towards;
  }

  Ball ball_;
};

Result<void> check(const Ball& ball, std::int64_t paths) {
  if (!(ball.reduced_albedo >= 0.0 && ball.reduced_albedo < 1.0))
    return invalid_argument(
        fmt::format("reduced albedo {}; expected 0 to below 1", ball.reduced_albedo));
  if (!(ball.radius >= 1.0 && ball.radius <= 1e6))
    return invalid_argument(
        fmt::format("radius of {} mean free paths; expected 1 to 1e6", ball.radius));
  if (!(ball.ior >= 1.0 && ball.ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", ball.ior));
  if (paths < 2 * kBatch || paths > std::int64_t{1} << 40U)
    return invalid_argument(fmt::format("{} paths; expected at least {}", paths, 2 * kBatch));
  return ok();
}

BallLight summary(const std::vector<Sums>& batches) {
  const auto count = static_cast<double>(batches.size());
  Sums mean;
  for (const Sums& batch : batches) {
    mean.constant += batch.constant / count;
    mean.gradient += batch.gradient / count;
  }
  BallLight light{mean.constant / kBatch, 0.0, mean.constant / mean.gradient, 0.0};
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

Result<BallLight> trace_ball(const Ball& ball,
                             std::int64_t paths,
                             std::uint64_t seed,
                             ThreadTeam& team) {
  if (Result<void> good = check(ball, paths); !good) return good.error();
  const Tracer tracer(ball);
  std::vector<Sums> batches(static_cast<std::size_t>((paths + kBatch - 1) / kBatch));
  team.run([&](int thread) {
    for (std::size_t b = thread; b < batches.size(); b += team.size()) {
      Numbers numbers(seed * 0x2545f4914f6cdd1dULL + b * 0xd1342543de82ef95ULL);
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
