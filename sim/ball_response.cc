#include "sim/ball_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/ball_walk.h"

namespace opaline::sim {
namespace {

using std::numbers::pi;

constexpr std::int64_t kBatch = 4096;

/// Value at a place counted in steps, values standing in the middle of theirs.
double interpolated(const std::vector<double>& values, double place) {
  const double at = std::clamp(place - 0.5, 0.0, static_cast<double>(values.size()) - 1.0);
  const auto n = std::min(static_cast<std::size_t>(at), values.size() - 2);
  const double part = at - static_cast<double>(n);
  return (1.0 - part) * values[n] + part * values[n + 1];
}

Result<void> check_response(const Ball& ball, double distance, const ResponseSize& size) {
  if (auto good = check(ball); !good) return good;
  if (!(distance > 1.0))
    return invalid_argument(
        fmt::format("a light at {} radii; expected it outside the ball", distance));
  if (size.paths < 10'000 || size.angles < 8 || size.cosines < 4)
    return invalid_argument("expected at least 10000 paths, 8 angles and 4 cosines");
  return ok();
}

struct Tally {
  std::vector<double> by_angle;
  std::vector<double> by_cosine;
};

/// Paths that enter where a light on the z axis shines, uniform in the solid angle that it sees of the ball.
class LitBall {
 public:
  LitBall(const Ball& ball, double distance)
      : ball_(ball),
        walk_(ball),
        distance_(distance * ball.radius),
        edge_(std::sqrt(1.0 - 1.0 / (distance * distance))) {}

  double solid_angle() const { return 2.0 * pi * (1.0 - edge_); }

  void trace(double share, PathNumbers& numbers, Tally& tally) const {
    const double down = 1.0 - share * (1.0 - edge_);  // cosine to the axis
    const double side = std::sqrt(1.0 - down * down);
    const Vec3 ray{side, 0.0, -down};
    const double half = distance_ * down;
    const double root = half * half - distance_ * distance_ + ball_.radius * ball_.radius;
    const Vec3 hit = Vec3{0.0, 0.0, distance_} + ray * (half - std::sqrt(std::max(0.0, root)));
    const Vec3 normal = hit * (1.0 / length(hit));
    const double cosine = std::clamp(-dot(ray, normal), 0.0, 1.0);
    const double bent = std::sqrt(1.0 - (1.0 - cosine * cosine) / (ball_.ior * ball_.ior));
    const Vec3 way = ray * (1.0 / ball_.ior) + normal * (cosine / ball_.ior - bent);
    const double entered = 1.0 - reflectance(cosine, 1.0, ball_.ior);
    const auto exit =
        walk_.walk(normal * ball_.radius, way * (1.0 / length(way)), entered, numbers);
    if (!exit || exit->collisions < 2) return;
    add(tally.by_angle, std::acos(std::clamp(exit->normal.z, -1.0, 1.0)) / pi, exit->weight);
    const double inside = exit->cosine_inside;
    const double sine = ball_.ior * ball_.ior * (1.0 - inside * inside);
    add(tally.by_cosine, std::sqrt(std::max(0.0, 1.0 - sine)), exit->weight);
  }

 private:
  static void add(std::vector<double>& bins, double share, double weight) {
    const auto n = static_cast<std::size_t>(share * static_cast<double>(bins.size()));
    bins[std::min(n, bins.size() - 1)] += weight;
  }

  Ball ball_;
  BallWalk walk_;
  double distance_;
  double edge_;  // cosine at which the ball ends, seen from the light
};

BallResponse response_of(const Tally& tally, const LitBall& lit, double paths, double distance) {
  BallResponse response;
  const auto angles = static_cast<double>(tally.by_angle.size());
  for (std::size_t n = 0; n < tally.by_angle.size(); ++n) {
    const double from = pi * static_cast<double>(n) / angles;
    const double area = 2.0 * pi * (std::cos(from) - std::cos(from + pi / angles));
    // Power I Omega over an area in squared radii, over I / d^2 in radii.
    response.exitance.push_back(tally.by_angle[n] / paths * lit.solid_angle() / area * distance *
                                distance);
  }
  double sum = 0.0;
  for (const double flux : tally.by_cosine) sum += flux;
  const auto cosines = static_cast<double>(tally.by_cosine.size());
  for (std::size_t n = 0; n < tally.by_cosine.size(); ++n) {
    const double from = static_cast<double>(n) / cosines;
    const double to = from + 1.0 / cosines;
    response.exit_law.push_back(tally.by_cosine[n] / sum / (to * to - from * from));
  }
  return response;
}

}  // namespace

double BallResponse::exitance_at(double cosine) const {
  const double share = std::acos(std::clamp(cosine, -1.0, 1.0)) / pi;
  return interpolated(exitance, share * static_cast<double>(exitance.size()));
}

double BallResponse::law_at(double cosine) const {
  return interpolated(exit_law, cosine * static_cast<double>(exit_law.size()));
}

Result<BallResponse> trace_response(const Ball& ball,
                                    double light_distance,
                                    const ResponseSize& size,
                                    std::uint64_t seed,
                                    ThreadTeam& team,
                                    std::stop_token stop) {
  if (auto good = check_response(ball, light_distance, size); !good) return good.error();
  const LitBall lit(ball, light_distance);
  const Tally none{std::vector<double>(static_cast<std::size_t>(size.angles), 0.0),
                   std::vector<double>(static_cast<std::size_t>(size.cosines), 0.0)};
  const std::int64_t batches = (size.paths + kBatch - 1) / kBatch;
  std::vector<Tally> tallies(64, none);  // sums in an order that does not depend on the threads
  const auto groups = static_cast<int>(tallies.size());
  team.run([&](int thread) {
    for (int group = thread; group < groups; group += team.size())
      for (std::int64_t b = group; b < batches; b += groups) {
        if (stop.stop_requested()) return;
        PathNumbers numbers(seed * 0x2545f4914f6cdd1dULL +
                            static_cast<std::uint64_t>(b) * 0xd1342543de82ef95ULL);
        for (std::int64_t n = 0; n < kBatch; ++n)
          lit.trace((static_cast<double>(n) + numbers.next()) / kBatch,
                    numbers,
                    tallies[static_cast<std::size_t>(group)]);
      }
  });
  if (stop.stop_requested()) return cancelled("light in a ball: stopped");
  Tally all = none;
  for (const Tally& tally : tallies) {
    std::ranges::transform(all.by_angle, tally.by_angle, all.by_angle.begin(), std::plus<>());
    std::ranges::transform(all.by_cosine, tally.by_cosine, all.by_cosine.begin(), std::plus<>());
  }
  return response_of(all, lit, static_cast<double>(batches * kBatch), light_distance);
}

}  // namespace opaline::sim
