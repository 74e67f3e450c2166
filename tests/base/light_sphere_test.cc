#include "base/light_sphere.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline {
namespace {

TEST(LightSphere, DirectionsAreUnitVectorsNoTwoOfThemNear) {
  for (const int count : {1, 60, 156, 346}) {
    const auto directions = light_sphere_directions(count);
    ASSERT_EQ(std::ssize(directions), count);
    double nearest = 4.0;
    for (std::size_t n = 0; n < directions.size(); ++n) {
      EXPECT_NEAR(length(directions[n]), 1.0, 1e-12);
      for (std::size_t m = 0; m < n; ++m)
        nearest = std::min(nearest, length(directions[n] - directions[m]));
    }
    // As far apart as half of what an even share of the sphere each would be.
    EXPECT_GT(nearest, 0.5 * std::sqrt(4.0 * std::numbers::pi / count));
  }
}

TEST(LightSphere, TheBuiltOnesLackWhatIsAroundTheStand) {
  for (const int count : {156, 346}) {
    const auto directions = light_sphere_directions(count);
    EXPECT_NEAR(directions.front().y, 1.0, 1e-12);
    double x = 0.0;
    double z = 0.0;
    for (const Vec3 d : directions) {
      EXPECT_GT(d.y, -0.95);
      x += d.x;
      z += d.z;
    }
    EXPECT_NEAR(x, 0.0, 1e-9);  // five-fold about the vertical
    EXPECT_NEAR(z, 0.0, 1e-9);
  }
}

}  // namespace
}  // namespace opaline
