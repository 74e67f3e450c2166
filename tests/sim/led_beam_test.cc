#include "sim/led_beam.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/ball_beam.h"
#include "tests/support/tiny_sphere.h"

namespace opaline::sim {
namespace {

using support::TinySphere;
using ::testing::HasSubstr;

constexpr int kAcross = 144;
constexpr double kPixel = 0.125;  // mm

TinySphere with_beam(Vec3 aim = {0.0, 0.0, 8.0}) {
  TinySphere tiny;
  tiny.sphere.beam = LedBeam{{0.0, 0.0, 500.0}, aim, 0.002, 60'000};
  CameraModel& model = tiny.rig.camera.model;  // near the beam the light falls steeply
  model.width = model.height = kAcross;
  model.fx = model.fy = 1000.0 / kPixel;
  model.cx = model.cy = 0.5 * kAcross;
  return tiny;
}

/// Mean exitance of the green channel in a ring around the middle, over the beam's power, by a law of 0.972/0.943 along the normal (led_sphere_test.cc).
double exitance(const Image<float>& radiance, double from_mm, double to_mm) {
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y < radiance.height(); ++y)
    for (int x = 0; x < radiance.width(); ++x) {
      const double across = kPixel * std::hypot(x + 0.5 - 0.5 * kAcross, y + 0.5 - 0.5 * kAcross);
      const double arc = 8.0 * std::asin(std::min(1.0, across / 8.0));
      if (arc < from_mm || arc >= to_mm) continue;
      sum += radiance.at(x, y, 1);
      ++count;
    }
  return std::numbers::pi * sum / count / (0.972 / 0.943) / 0.5 / 0.002;
}

TEST(BeamLight, LiesAroundTheBeamAsItsTracedProfileSays) {
  const TinySphere tiny = with_beam();
  NullSink events;
  const auto light = BeamLight::trace(tiny.sphere, tiny.rig.camera, events, {});
  ASSERT_TRUE(light) << light.error().message;
  Image<float> radiance(kAcross, kAcross, 3);
  light->add(1.0, radiance);

  const double free_path =
      std::sqrt(3.0 * (1.0 - tiny.sphere.reduced_albedo[1])) * tiny.sphere.translucency_mm[1];
  ThreadTeam team(2);
  // rings of 1 mm
  const auto profile = *trace_beam({tiny.sphere.reduced_albedo[1], 8.0 / free_path, 1.4},
                                   4.0 / free_path,
                                   4,
                                   100'000,
                                   3,
                                   team,
                                   {});
  for (int ring = 1; ring < 4; ++ring) {
    const auto n = static_cast<std::size_t>(ring);
    const double truth = profile.exitance[n] / (free_path * free_path);
    // 3 %: pixels of an eighth of a ring, perspective; noise of both, six deviations of one
    EXPECT_NEAR(exitance(radiance, ring, ring + 1.0),
                truth,
                0.03 * truth + 6.0 * profile.deviation[n] / (free_path * free_path));
  }
}

TEST(BeamLight, ShinesAsTheLastLampsCodeSays) {
  TinySphere tiny = with_beam();
  tiny.lights.push_back({{0.0, 0.0, 500.0}, 0.0});
  const auto path = tiny.path();
  std::vector<std::uint8_t> codes(tiny.lights.size(), 0);
  const auto seen = [&](std::uint8_t code) {
    codes.back() = code;
    return path->light(drivers::stage_picture({1, codes}).codes).surface_radiance.at(80, 72, 1);
  };
  EXPECT_EQ(seen(0), 0.0F);
  EXPECT_GT(seen(255), 0.0F);
  EXPECT_NEAR(seen(51), 0.2F * seen(255), 1e-6F * seen(255));
}

TEST(BeamLight, OneThatMissesTheObjectIsAnError) {
  const TinySphere tiny = with_beam({30.0, 0.0, 0.0});
  NullSink events;
  const auto light = BeamLight::trace(tiny.sphere, tiny.rig.camera, events, {});
  ASSERT_FALSE(light);
  EXPECT_THAT(light.error().message, HasSubstr("the beam misses the object"));
}

}  // namespace
}  // namespace opaline::sim
