#include "sim/ball_beam.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "sim/ball_walk.h"

namespace opaline::sim {
namespace {

using std::numbers::pi;

constexpr std::int64_t kBatch = 4096;
constexpr std::size_t kGroups = 64;  // sums in an order that does not depend on the threads

struct Rings {
  std::vector<double> weight;
  std::vector<double> square;
};

}  // namespace

Result<BeamProfile> trace_beam(const Ball& ball,
                               double reach,
                               int rings,
                               std::int64_t paths,
                               std::uint64_t seed,
                               ThreadTeam& team,
                               std::stop_token stop) {
  if (auto good = check(ball); !good) return good.error();
  if (!(reach > 0.0 && reach < 0.5 * pi * ball.radius) || rings < 2 || paths < kBatch)
    return invalid_argument(fmt::format(
        "beam: {} rings out to {} mean free paths; expected 2 or more within a quarter turn "
        "of a radius of {}",
        rings,
        reach,
        ball.radius));
  const auto count = static_cast<std::size_t>(rings);
  const double width = reach / rings;
  const BallWalk walk(ball);
  const double entered = 1.0 - reflectance(1.0, 1.0, ball.ior);
  const std::int64_t batches = (paths + kBatch - 1) / kBatch;
  std::vector<Rings> groups(kGroups, {std::vector<double>(count), std::vector<double>(count)});
  team.run([&](int thread) {
    for (auto group = static_cast<std::size_t>(thread); group < kGroups;
         group += static_cast<std::size_t>(team.size()))
      for (auto b = static_cast<std::int64_t>(group); b < batches;
           b += static_cast<std::int64_t>(kGroups)) {
        if (stop.stop_requested()) return;
        PathNumbers numbers(seed * 0x2545f4914f6cdd1dULL +
                            static_cast<std::uint64_t>(b) * 0xd1342543de82ef95ULL);
        for (std::int64_t n = 0; n < kBatch; ++n) {
          const auto exit = walk.walk({0.0, 0.0, ball.radius}, {0.0, 0.0, -1.0}, entered, numbers);
          if (!exit || exit->collisions < 2) continue;
          const double arc = ball.radius * std::acos(std::min(1.0, std::max(-1.0, exit->normal.z)));
          const auto ring = static_cast<std::size_t>(arc / width);
          if (ring >= count) continue;
          groups[group].weight[ring] += exit->weight;
          groups[group].square[ring] += exit->weight * exit->weight;
        }
      }
  });
  if (stop.stop_requested()) return cancelled("beam: stopped");
  BeamProfile profile;
  const auto all = static_cast<double>(batches * kBatch);
  for (std::size_t n = 0; n < count; ++n) {
    double weight = 0.0;
    double square = 0.0;
    for (const Rings& group : groups) {
      weight += group.weight[n];
      square += group.square[n];
    }
    const double from = static_cast<double>(n) * width / ball.radius;
    const double area = 2.0 * pi * ball.radius * ball.radius *
                        (std::cos(from) - std::cos(from + width / ball.radius));
    profile.distance.push_back((static_cast<double>(n) + 0.5) * width);
    profile.exitance.push_back(weight / all / area);
    profile.deviation.push_back(std::sqrt(square) / all / area);
  }
  return profile;
}

}  // namespace opaline::sim
