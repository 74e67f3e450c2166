#include "sim/led_sphere.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/tiny_sphere.h"

namespace opaline::sim {
namespace {

using support::TinySphere;
using ::testing::HasSubstr;

float pixel(const StationLight& light, int x, int y, int c = 0) {
  return light.surface_radiance.at(x, y, c);
}

TEST(LedSphere, ShowsWhatTheBallsReflectanceSaysUnderManyEvenLights) {
  TinySphere tiny;
  tiny.lights = light_sphere(500, 500.0, 2.0);
  tiny.sphere.paths = 40'000;
  const auto path = tiny.path();
  const StationLight light = path->light(tiny.all(255));
  ThreadTeam team(2);
  const double free_path =
      std::sqrt(3.0 * (1.0 - tiny.sphere.reduced_albedo[1])) * tiny.sphere.translucency_mm[1];
  const BallLight truth =
      *trace_ball({tiny.sphere.reduced_albedo[1], 8.0 / free_path, 1.4}, 100'000, 9, team);
  // Lights of 2 W/sr on 500 mm, 500 of them in 4 pi sr, are as bright as a surface of this radiance:
  const double around = 500.0 * 2.0 / (500.0 * 500.0) / (4.0 * std::numbers::pi);
  // Along the normal a little more leaves than a Lambertian surface's even share: light that arrives evenly inside leaves by Fresnel's
  // transmittance, 0.972 there and 0.943 on average. The tolerance: 1 % for that law, 1 % for the lights, 1 % for the paths.
  const double share = pixel(light, 24, 24, 1) / (0.5 * truth.reflectance * around);
  EXPECT_NEAR(share, 0.972 / 0.943, 0.03);
  // The exit law's mean over the visible half is that of its flux, so a pixel further out shows less.
  EXPECT_LT(pixel(light, 42, 24, 1), pixel(light, 24, 24, 1));
}

TEST(LedSphere, LightAddsUpAndFollowsTheCodes) {
  const TinySphere tiny;
  const auto path = tiny.path();
  Image<std::uint8_t> some = tiny.all(0);
  Image<std::uint8_t> others = tiny.all(200);
  for (int n = 0; n < 20; ++n)
    for (int c = 0; c < 3; ++c) std::swap(some.at(n, 0, c), others.at(n, 0, c));
  const StationLight a = path->light(some);
  const StationLight b = path->light(others);
  const StationLight all = path->light(tiny.all(100));
  EXPECT_NEAR(
      pixel(a, 20, 30) + pixel(b, 20, 30), 2.0 * pixel(all, 20, 30), 1e-5 * pixel(all, 20, 30));
  EXPECT_EQ(pixel(path->light(tiny.all(0)), 24, 24), 0.0F);
  EXPECT_EQ(pixel(all, 0, 0), 0.0F);  // beside the ball
}

TEST(LedSphere, LightFromOneSideIsBrighterThere) {
  const TinySphere tiny;
  const auto path = tiny.path();
  Image<std::uint8_t> right = tiny.all(0);
  for (std::size_t n = 0; n < tiny.lights.size(); ++n)
    if (tiny.lights[n].position.x > 250.0)
      for (int c = 0; c < 3; ++c) right.at(static_cast<int>(n), 0, c) = 255;
  const StationLight light = path->light(right);
  EXPECT_GT(pixel(light, 40, 24), 3.0F * pixel(light, 8, 24));
  EXPECT_GT(pixel(light, 20, 24), 0.0F);
  // Red goes further than blue in the default material, so its terminator is softer.
  EXPECT_GT(pixel(light, 16, 24, 0) / pixel(light, 40, 24, 0),
            pixel(light, 16, 24, 2) / pixel(light, 40, 24, 2));
}

TEST(LedSphere, ParallelPolarisersAddTheSurfacesReflection) {
  const TinySphere tiny;
  const auto path = tiny.path();
  const StationLight cross = path->light(tiny.all(255));
  const StationLight parallel = path->light(tiny.all(255, drivers::Polarization::kParallel));
  double mirrored = 0.0;
  double around = 0.0;
  for (int y = 12; y < 36; ++y)
    for (int x = 12; x < 36; ++x) {
      mirrored += pixel(parallel, x, y) - pixel(cross, x, y);
      around += 60.0 / (500.0 * 500.0) / (4.0 * std::numbers::pi);
      EXPECT_GE(pixel(parallel, x, y), pixel(cross, x, y));
    }
  EXPECT_NEAR(
      mirrored / around, std::pow(0.4 / 2.4, 2), 0.006);  // Fresnel at near-normal incidence
}

TEST(LedSphere, ADeadLightIsMissed) {
  TinySphere tiny;
  const StationLight whole = tiny.path()->light(tiny.all(255));
  tiny.sphere.dead_lights = {0};
  const StationLight less = tiny.path()->light(tiny.all(255));
  EXPECT_EQ(less.patch_irradiance[0][0], 0.0);
  EXPECT_LT(pixel(less, 24, 10), pixel(whole, 24, 10));
}

TEST(LedSphere, TellsItsTruth) {
  const TinySphere tiny;
  const auto rig = tiny.make_rig(tiny.path());
  const auto truth = rig->truth();
  ASSERT_TRUE(truth);
  EXPECT_THAT(truth->scene, HasSubstr("\"translucency_mm\":[2.0,1.4,1.0]"));
  EXPECT_EQ(truth->patches_x, 60);
}

TEST(LedSphere, NamesWhatIsWrong) {
  TinySphere tiny;
  NullSink events;
  const auto message = [&] {
    const auto made = LedSphere::create(tiny.sphere, tiny.lights, tiny.rig.camera, events, {});
    return made ? std::string() : made.error().message;
  };
  tiny.sphere.dead_lights = {60};
  EXPECT_THAT(message(), HasSubstr("dead_lights = 60; expected 0 to 59"));
  tiny.sphere.dead_lights = {};
  tiny.sphere.radii_mm = {0.1};
  EXPECT_THAT(message(), HasSubstr("ball of 0.1 mm"));
}

}  // namespace
}  // namespace opaline::sim
