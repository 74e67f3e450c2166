#include "sim/ball_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace opaline::sim {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFar = 1e4;  // radii: light that comes in parallel

BallResponse traced(const Ball& ball, double distance = kFar, std::int64_t paths = 200'000) {
  ThreadTeam team(2);
  return *trace_response(ball, distance, {.paths = paths}, 3, team, {});
}

/// int exitance P_l(cos theta) dcos theta / 2 over all of the ball.
double moment(const BallResponse& response, int degree) {
  double sum = 0.0;
  const auto count = static_cast<double>(response.exitance.size());
  for (std::size_t n = 0; n < response.exitance.size(); ++n) {
    const double from = std::cos(kPi * static_cast<double>(n) / count);
    const double to = std::cos(kPi * static_cast<double>(n + 1) / count);
    sum += response.exitance[n] * (degree == 0 ? from - to : 0.5 * (from * from - to * to)) / 2.0;
  }
  return sum;
}

// By reciprocity of the two symmetric set-ups, the ball under light from all sides (trace_ball: another estimator, entering at one point) and
// under one light (here) say the same: R = 4 <exitance>, r = <exitance> / <exitance cos>. The tolerances are four of the deviations of the
// noise of both.
TEST(BallResponse, SumsToWhatLightFromAllSidesShows) {
  const Ball ball{0.96, 1.0 / (std::sqrt(3.0 * 0.04) * 0.15), 1.4};
  ThreadTeam team(2);
  const BallLight light = *trace_ball(ball, 400'000, 5, team);
  const BallResponse response = traced(ball, kFar, 400'000);
  EXPECT_NEAR(4.0 * moment(response, 0),
              light.reflectance,
              4.0 * std::sqrt(2.0) * light.reflectance_deviation);
  EXPECT_NEAR(
      moment(response, 0) / moment(response, 1), light.ratio, 4.0 * 2.0 * light.ratio_deviation);
}

TEST(BallResponse, FadesIntoTheDark) {
  const Ball ball{0.96, 1.0 / (std::sqrt(3.0 * 0.04) * 0.15), 1.4};
  const BallResponse response = traced(ball);
  EXPECT_GT(response.exitance_at(0.9), response.exitance_at(0.5));
  EXPECT_GT(response.exitance_at(0.5), response.exitance_at(0.0));
  EXPECT_GT(response.exitance_at(-0.05), response.exitance_at(-0.3));
  EXPECT_GT(response.exitance_at(-0.1), 0.01 * response.exitance_at(1.0));  // it is translucent
}

TEST(BallResponse, ANearLightSeesLessOfTheBall) {
  const Ball ball{0.9, 100.0, 1.4};
  const BallResponse near = traced(ball, 4.0);
  const BallResponse far = traced(ball);
  // Beyond the light's horizon, cos theta = 1/4, nothing is lit; below the light (4/3)^2 as much.
  EXPECT_LT(near.exitance_at(0.15), 0.1 * far.exitance_at(0.15));
  EXPECT_NEAR(near.exitance_at(0.98) / far.exitance_at(0.98), 16.0 / 9.0, 0.15);
}

TEST(BallResponse, TheExitLawKeepsTheFlux) {
  const BallResponse response = traced({0.97, 20.0, 1.4});
  double sum = 0.0;
  for (std::size_t n = 0; n < response.exit_law.size(); ++n)
    sum += response.exit_law[n] * (2.0 * static_cast<double>(n) + 1.0);
  EXPECT_NEAR(sum / std::pow(static_cast<double>(response.exit_law.size()), 2), 1.0, 1e-12);
  EXPECT_GT(response.law_at(0.95),
            response.law_at(0.2));  // Fresnel's mirror keeps grazing light in
}

TEST(BallResponse, DoesNotDependOnTheThreads) {
  const Ball ball{0.9, 10.0, 1.4};
  ThreadTeam one(1);
  ThreadTeam three(3);
  EXPECT_EQ(trace_response(ball, 60.0, {.paths = 20'000}, 1, one, {})->exitance,
            trace_response(ball, 60.0, {.paths = 20'000}, 1, three, {})->exitance);
}

}  // namespace
}  // namespace opaline::sim
