#include "reconstruct/direct_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/prediction.h"

namespace opaline::reconstruct {
namespace {

constexpr double kScattering = 2.0;
constexpr double kAbsorption = 0.02;

// Pictures of a homogeneous block lit on a quarter of the face that is seen, or of the one behind.
Dataset quarter_lit(Face lit, diffusion::FluenceSolver& solver) {
  Dataset dataset;
  dataset.block = {16, 16, 8, 0.5, 0.5, 0.5};
  dataset.lit_face = lit;
  dataset.view_cosine = Image<float>(16, 16, 1, 0.95F);
  for (int quarter = 0; quarter < 4; ++quarter) {
    Illumination i;
    i.name = "quarter_" + std::to_string(quarter);
    i.irradiance = Image<float>(16, 16, 3);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        for (int c = 0; c < 3; ++c)
          i.irradiance.at(x + quarter % 2 * 8, y + quarter / 2 * 8, c) = 1.0F;
      }
    }
    i.radiance = Image<float>(16, 16, 3);
    i.radiance_variance = Image<float>(16, 16, 3, 1e-8F);
    i.mask = Image<std::uint8_t>(16, 16, 1, 1);
    dataset.illuminations.push_back(std::move(i));
  }
  Material material{dataset.block, dataset.ior, {}, "homogeneous"};
  for (auto& channel : material.channels) {
    channel.reduced_scattering.assign(dataset.block.cell_count(), kScattering);
    channel.absorption.assign(dataset.block.cell_count(), kAbsorption);
  }
  const auto pictures = predict(dataset, material, {}, solver, {});
  for (std::size_t m = 0; m < 4; ++m) dataset.illuminations[m].radiance = (*pictures)[m];
  return without_direct_light(dataset, 0.0);
}

// The pictures are exact but for rounding to float (1e-7) and the solves' tolerance (1e-5), amplified by the fit.
TEST(DirectLightMargin, IsThreeMeanFreePathsOfTheSampleThatExplainsThePictures) {
  const auto solver = diffusion::make_reference_solver();
  const Dataset dataset = quarter_lit(Face::kZMax, *solver);
  const auto margin = direct_light_margin(dataset, {}, *solver, {});
  ASSERT_TRUE(margin) << margin.error().message;
  const double expected = 3.0 / (kScattering + kAbsorption);
  EXPECT_NEAR(*margin, expected, 0.02 * expected);
}

TEST(DirectLightMargin, IsNoneWhereAnotherFaceIsSeen) {
  const auto solver = diffusion::make_reference_solver();
  const Dataset dataset = quarter_lit(Face::kZMin, *solver);
  EXPECT_EQ(*direct_light_margin(dataset, {}, *solver, {}), 0.0);
  const Dataset same = without_direct_light(dataset, 3.0);
  for (std::size_t m = 0; m < 4; ++m) {
    EXPECT_EQ(same.illuminations[m].mask, dataset.illuminations[m].mask);
  }
}

// Three cells beside the lit quarter have their middles within 1.5 mm: at 0.25, 0.75 and 1.25 mm.
TEST(DirectLightMargin, MasksSoMuchBesideEachLitRegion) {
  const auto solver = diffusion::make_reference_solver();
  const Dataset masked = without_direct_light(quarter_lit(Face::kZMax, *solver), 1.5);
  const auto& mask = masked.illuminations[0].mask;
  for (int x = 0; x < 16; ++x) EXPECT_EQ(mask.at(x, 0), x < 11 ? 0 : 1) << x;
}

TEST(DirectLightMargin, SaysSoWhenNothingCanBeSeen) {
  const auto solver = diffusion::make_reference_solver();
  Dataset dataset = quarter_lit(Face::kZMax, *solver);
  for (auto& i : dataset.illuminations) std::ranges::fill(i.mask.samples(), std::uint8_t{0});
  const auto margin = direct_light_margin(dataset, {}, *solver, {});
  ASSERT_FALSE(margin);
  EXPECT_EQ(margin.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace opaline::reconstruct
