#include "sim/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/noise.h"

namespace opaline::sim {
namespace {

using testing::HasSubstr;

TEST(Scene, DemoMarbleStaysWhereDiffusionHolds) {
  const auto marble = make_material({});
  ASSERT_TRUE(marble);
  for (const ChannelCoefficients& channel : marble->channels) {
    const auto [least, most] =
        std::minmax_element(channel.reduced_scattering.begin(), channel.reduced_scattering.end());
    EXPECT_GT(*least, 0.5);
    EXPECT_LT(*most, 3.0);
    EXPECT_GT(*most / *least, 2.0);  // heterogeneous all the same
    const auto [clear, dark] =
        std::minmax_element(channel.absorption.begin(), channel.absorption.end());
    EXPECT_GT(*clear, 0.001);
    EXPECT_LT(*dark, 0.05);
    EXPECT_GT(*dark / *clear, 3.0);
  }
  EXPECT_NE(marble->channels[0], marble->channels[2]);
}

TEST(Scene, EveryKindIsMadeFromItsSeedAlone) {
  for (const char* name : {"layered", "wax", "marble", "stone"}) {
    SceneOptions options{.kind = *scene_kind(name), .seed = 5, .block = {9, 8, 7, 0.5, 0.5, 0.5}};
    const auto one = make_material(options);
    const auto same = make_material(options);
    options.seed = 6;
    const auto other = make_material(options);
    ASSERT_TRUE(one && same && other);
    EXPECT_EQ(*one, *same) << name;
    EXPECT_NE(*one, *other) << name;
  }
}

TEST(Scene, HomogeneousIsTheSameEverywhere) {
  const auto material =
      make_material({.kind = SceneKind::kHomogeneous, .block = {3, 2, 2, 1, 1, 1}});
  ASSERT_TRUE(material);
  for (const ChannelCoefficients& channel : material->channels) {
    EXPECT_EQ(
        std::count(channel.absorption.begin(), channel.absorption.end(), channel.absorption[0]),
        12);
  }
  EXPECT_EQ(material->channels[1].reduced_scattering[0], 1.6);
  EXPECT_EQ(material->channels[1].absorption[0], 0.004);
}

TEST(Scene, ComesBackFromItsDescription) {
  const SceneOptions options{.kind = SceneKind::kStone,
                             .seed = 0xffffffffffffffffU,
                             .block = {5, 6, 7, 0.1, 1.0 / 3.0, 2.0},
                             .ior = 1.45,
                             .reduced_scattering = 2.1,
                             .absorption = 0.0123,
                             .contrast = 0.5,
                             .feature_mm = 3.25};
  const auto back = scene_from_json(to_json(options));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(*back, options);
}

TEST(Scene, SaysWhatIsWrongWithADescriptionOrValue) {
  EXPECT_FALSE(scene_from_json("{}"));
  EXPECT_FALSE(scene_from_json("not json"));
  EXPECT_THAT(scene_kind("jelly").error().message, HasSubstr("marble"));
  EXPECT_THAT(make_material({.ior = 5.0}).error().message, HasSubstr("ior = 5; expected 1 to 3"));
  EXPECT_FALSE(make_material({.reduced_scattering = 0.0}));
  EXPECT_FALSE(make_material({.absorption = std::nan("")}));
  EXPECT_FALSE(make_material({.block = {0, 1, 1, 1.0, 1.0, 1.0}}));
}

TEST(Noise, IsContinuousAndBounded) {
  double largest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p{0.37 * i, 0.11 * i - 50.0, -0.23 * i};
    const double value = gradient_noise(p, 3);
    largest = std::max(largest, std::abs(value));
    EXPECT_NEAR(gradient_noise(p + Vec3{1e-6, 1e-6, 1e-6}, 3), value, 2e-5);
  }
  EXPECT_GT(largest, 0.5);
  EXPECT_LE(largest, 1.1);
  EXPECT_EQ(gradient_noise({3.0, -2.0, 7.0}, 3), 0.0);
}

TEST(Noise, NearestPointsAreInOrder) {
  for (int i = 0; i < 100; ++i) {
    const CellNoise noise = cell_noise({0.7 * i, 0.3 * i, 0.9 * i}, 1);
    EXPECT_LE(noise.nearest, noise.second);
    EXPECT_LT(noise.nearest, 1.74);  // a cell's diagonal
  }
}

}  // namespace
}  // namespace opaline::sim
