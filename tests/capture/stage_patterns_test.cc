#include "capture/stage_patterns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace opaline::capture {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<Vec3, 3> kAxes{Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}};

TEST(SphereWeights, IntegratePolynomialsThoughTheSphereHasAHole) {
  for (const int count : {60, 156, 346}) {
    const auto directions = light_sphere_directions(count);
    const SphereWeights even = sphere_weights(directions);
    EXPECT_GE(even.degree, count == 60 ? 3 : 4);
    // int z^2k = 4 pi / (2 k + 1), int of odd powers 0, about any axis; the damping allows 1e-6 of the weights' spread.
    for (const Vec3 axis : {Vec3{0, 1, 0}, normalized({1, 2, 3})})
      for (int power = 0; power <= even.degree; ++power) {
        double sum = 0.0;
        for (std::size_t n = 0; n < directions.size(); ++n)
          sum += even.weights[n] * std::pow(dot(directions[n], axis), power);
        EXPECT_NEAR(sum, power % 2 == 0 ? 4.0 * kPi / (power + 1.0) : 0.0, 2e-5)
            << count << ", power " << power;
      }
  }
}

/// Moments of what falls on the middle: 1, x, y, z (along kAxes), by the lamps' codes.
std::array<double, 4> moments(std::span<const SphereLight> lights,
                              std::span<const std::uint8_t> codes) {
  std::array<double, 4> sum{};
  for (std::size_t n = 0; n < lights.size(); ++n) {
    const double power =
        codes[n] * lights[n].intensity / dot(lights[n].position, lights[n].position);
    sum[0] += power;
    for (std::size_t a = 0; a < 3; ++a)
      sum[a + 1] += power * dot(normalized(lights[n].position), kAxes[a]);
  }
  return sum;
}

TEST(StagePatterns, HaveTheirMomentsWhateverTheLampsAre) {
  auto lights = light_sphere(156, 600.0, 1.0);
  for (std::size_t n = 0; n < lights.size(); ++n) {  // uneven lamps, not all equally far
    lights[n].intensity = 1.0 + 0.2 * std::sin(1.7 * static_cast<double>(n));
    lights[n].position = lights[n].position * (1.0 + 0.05 * std::cos(2.3 * static_cast<double>(n)));
  }
  lights[40].intensity = 0.0;
  const auto patterns = *stage_patterns(lights, kAxes, {});
  ASSERT_EQ(patterns.size(), 6U);
  const auto constant = moments(lights, patterns[0].codes);
  // Whole codes: each lamp is off by up to half a code in about 100, which adds up as a random walk over 155 lamps: 0.3/100/sqrt(155) of the sum.
  constexpr double kRounding = 4.0 * 0.0003;
  for (std::size_t a = 1; a < 4; ++a) EXPECT_NEAR(constant[a] / constant[0], 0.0, kRounding);
  for (std::size_t p = 1; p < 4; ++p) {
    const auto gradient = moments(lights, patterns[p].codes);
    EXPECT_NEAR(gradient[0] / constant[0], 0.5, kRounding);
    for (std::size_t a = 1; a < 4; ++a)  // int omega_a (1 + omega_p)/2 = 2 pi/3, a = p
      EXPECT_NEAR(gradient[a] / constant[0], a == p ? 1.0 / 6.0 : 0.0, kRounding);
  }
  EXPECT_EQ(patterns[0].codes[40], 0);
  EXPECT_EQ(std::ranges::max(patterns[0].codes), 255);
  EXPECT_TRUE(patterns[4].parallel);
  EXPECT_EQ(patterns[5].name, "constant_again");
}

TEST(StagePatterns, HalvesMakeTheWholeGradient) {
  const auto lights = light_sphere(346, 600.0, 1.0);
  const auto patterns = *stage_patterns(lights, kAxes, {.split = true, .specular = false});
  ASSERT_EQ(patterns.size(), 8U);
  const auto plus = moments(lights, patterns[1].codes);
  const auto minus = moments(lights, patterns[2].codes);
  const auto constant = moments(lights, patterns[0].codes);
  EXPECT_EQ(patterns[1].name, "gradient_x_plus");
  EXPECT_NEAR((plus[1] - minus[1]) / constant[0], 1.0 / 3.0, 0.001);
  EXPECT_NEAR((plus[0] - minus[0]) / constant[0], 0.0, 0.001);
}

TEST(StagePatterns, TooFewLampsAreRefused) {
  const auto lights = light_sphere(11, 600.0, 1.0);
  EXPECT_THAT(stage_patterns(lights, kAxes, {}).error().message,
              ::testing::HasSubstr("11 working lights; expected at least 12"));
}

}  // namespace
}  // namespace opaline::capture
