#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim/ball_transport.h"
#include "sim/exit_light.h"

namespace opaline::reconstruct {
namespace {

/// k l_d, albedo.
struct Case {
  double albedo;
  double curvature;
};

sim::Ball ball_of(const Case& c, double ior) {
  return {c.albedo, 1.0 / (std::sqrt(3.0 * (1.0 - c.albedo)) * c.curvature), ior};
}

// estimate_scattering() takes the tilt of the gradients' vector for that of a look one mean free path deep along the refracted ray, sin(theta)/(radius
// ior); its deviation says "a fifth". Curvatures where the tilt is well above the paths' noise.
TEST(CameraTilt, IsThatOfALookAMeanFreePathDeep) {
  ThreadTeam team(2);
  for (const double ior : {1.3, 1.4, 1.5})
    for (const Case c : {Case{0.8, 0.2}, {0.9, 0.15}, {0.95, 0.3}, {0.98, 0.3}}) {
      const sim::Ball ball = ball_of(c, ior);
      const auto light = sim::trace_ball(ball, 400'000, 5, team);
      ASSERT_TRUE(light);
      EXPECT_NEAR(light->tilt * ball.radius * ior, 1.0, 0.2) << c.albedo << " at " << ior;
    }
}

TEST(CameraTilt, GrowsAsTheSineAndIsNoneOnAFlatSurface) {
  ThreadTeam team(2);
  constexpr std::array kEdges{0.1, 0.4, 0.7, 1.0};
  const sim::Ball ball = ball_of({0.9, 0.3}, 1.4);
  const auto bent = sim::trace_exit_light(ball, kEdges, 600'000, 3, team);
  const auto flat = sim::trace_exit_light({0.9, 1e5, 1.4}, kEdges, 300'000, 3, team);
  ASSERT_TRUE(bent && flat);
  for (const sim::ExitLight& e : *bent) {
    const double expected = std::sqrt(1.0 - e.cosine * e.cosine) / (ball.radius * 1.4);
    EXPECT_NEAR(e.tilt, expected, 0.2 * expected + 4.0 * e.tilt_deviation);
  }
  for (const sim::ExitLight& e : *flat) EXPECT_NEAR(e.tilt, 0.0, 4.0 * e.tilt_deviation);
}

}  // namespace
}  // namespace opaline::reconstruct
