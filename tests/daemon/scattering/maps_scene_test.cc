#include "daemon/scattering/maps_scene.h"

#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/curvature_ratio.h"
#include "tests/support/ball_maps.h"

namespace opaline::daemon {
namespace {

using support::kPixels;

constexpr double kIor = 1.4;
constexpr float kBright = 0.4F;  // of a white surface, under constant light
constexpr float kRatio = 1.6F;

/// Its pictures: the constant one is even, and the gradients' are (C + n C / r) / 2.
SphereSession pictured(const SphereMaps& maps) {
  SphereSession session = support::ball_session(maps);
  session.record.lights = light_sphere(60, 600.0, 1.0);
  for (const char* name : {"constant", "gradient_x", "gradient_y", "gradient_z", "constant_again"})
    session.record.pictures.push_back({name, std::vector<std::uint8_t>(60, 255)});
  const auto white = static_cast<float>(white_radiance(session.record));
  for (const StagePicture& shown : session.record.pictures) {
    HdrPicture picture{
        Image<float>(kPixels, kPixels, 3), Image<float>(kPixels, kPixels, 3), {}, {}};
    for (int y = 0; y < kPixels; ++y)
      for (int x = 0; x < kPixels; ++x) {
        const auto at = static_cast<std::size_t>(y * kPixels + x);
        const auto& m = maps.channels[0];
        const float n = shown.name == "gradient_x"   ? m.normal_x[at]
                        : shown.name == "gradient_y" ? m.normal_y[at]
                                                     : m.normal_z[at];
        const bool even = shown.name.starts_with("constant");
        const float light = even ? 1.0F : 0.5F * (1.0F + n / kRatio);
        for (int c = 0; c < 3; ++c)
          picture.radiance.at(x, y, c) =
              session.measured.at(x, y) != 0 ? white * kBright * light : 0.0F;
      }
    session.pictures.emplace(shown.name, std::move(picture));
  }
  return session;
}

MapsScene ball() {
  SphereMaps maps = support::ball_maps(false);
  for (auto& channel : maps.channels)  // l_d 0.6 mm: less to sum
    for (float& diffusion : channel.diffusion) diffusion *= 0.4F;
  SphereSession session = pictured(maps);
  auto scene = MapsScene::make(std::move(session), std::move(maps), kIor, "ball", {});
  EXPECT_TRUE(scene) << scene.error().message;
  return *std::move(scene);
}

render::LinearLight light(const char* name) { return *light_of_pattern(name); }

TEST(MapsScene, WhatWasCapturedAddsUpToAnyLinearLight) {
  const MapsScene scene = ball();
  const auto even = scene.captured(light("constant"));
  const auto aside = scene.captured(light("gradient_x"));
  EXPECT_NEAR(even.at(48, 48, 1), kBright, 1e-6);
  EXPECT_NEAR(even.at(80, 48, 1), kBright, 1e-6);
  const double n = (80.5 - 48.0) * support::kPixelMm / support::kRadius;
  EXPECT_NEAR(aside.at(80, 48, 1), 0.5 * kBright * (1.0 + n / kRatio), 1e-6);
  EXPECT_EQ(even.at(2, 2, 1), 0.0F);
  EXPECT_FALSE(light_of_pattern("gradient_w"));
}

// A flat surface of that material shows R_d int 2 Ft mu dmu (1 - R(0)) / int 2 Ft mu dmu along its normal; a ball of R differs by the order of
// l_d/R squared, and sums over texels of 0.2 mm by that of their square over the nearest source's depth, 3 D = 0.24 mm: some per cent both.
TEST(MapsScene, TheDipolesOfTheCapturedViewAreThoseOfTheMapsMaterial) {
  MapsScene scene = ball();
  const auto rendered = scene.rendered(light("constant"), {});
  ASSERT_TRUE(rendered) << rendered.error().message;
  const double expected = reconstruct::CurvatureRatio::make(kIor)->diffuse_albedo(0.95) *
                          (1.0 - reconstruct::diffusion::fresnel_reflectance(1.0, kIor));
  EXPECT_NEAR(rendered->at(48, 48, 1), expected, 0.05 * expected);
  const auto from_right = scene.rendered(light("gradient_x"), {});
  ASSERT_TRUE(from_right);
  EXPECT_GT(from_right->at(70, 48, 1), 1.3F * from_right->at(26, 48, 1));
}

// The same surface by another way to its places: what enters outside the picture is missing from both.
TEST(MapsScene, TheCapturedViewInScreenSpaceIsTheSame) {
  MapsScene scene = ball();
  const auto rendered = scene.rendered(light("gradient_y"), {});
  const auto turned = scene.turned(0.0, 0.0, light("gradient_y"), 76, {});
  ASSERT_TRUE(rendered && turned);
  const int middle = turned->width() / 2;
  for (const double off : {-0.5, 0.0, 0.5}) {  // of the radius, down
    const int there = static_cast<int>(48 + off * support::kRadius / support::kPixelMm);
    const double seen = 0.9 * 2.0 * support::kRadius * 1.05;
    const int here = static_cast<int>(middle + off * support::kRadius / seen * 76.0);
    EXPECT_NEAR(
        turned->at(middle, here, 1), rendered->at(48, there, 1), 0.05 * rendered->at(48, there, 1))
        << off;
  }
}

TEST(MapsScene, LightsStandStillWhileTheObjectTurns) {
  const MapsScene scene = ball();
  for (const double turn : {-40.0, 40.0}) {
    const auto turned = scene.turned(turn, 0.0, light("gradient_x"), 48, {});
    ASSERT_TRUE(turned);
    double left = 0.0;
    double right = 0.0;
    for (int y = 0; y < turned->height(); ++y)
      for (int x = 0; x < turned->width(); ++x)
        (2 * x < turned->width() ? left : right) += turned->at(x, y, 1);
    EXPECT_GT(right, 1.2 * left) << turn;
  }
}

TEST(MapsScene, StopsWhenAsked) {
  MapsScene scene = ball();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(scene.rendered(light("constant"), stop.get_token()).error().code,
            ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::daemon
