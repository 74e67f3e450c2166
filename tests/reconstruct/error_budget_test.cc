#include "reconstruct/error_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/prediction.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using testing_support::make_synthetic_dataset;

// Pictures of radiance 2 that a prediction misses by `bias` and noise of `sigma`.
Illumination picture(bool held_out, double bias, double sigma, std::mt19937& random) {
  constexpr int kSide = 40;
  Illumination i;
  i.held_out = held_out;
  i.radiance = Image<float>(kSide, kSide, kColorChannels);
  i.radiance_variance =
      Image<float>(kSide, kSide, kColorChannels, static_cast<float>(sigma * sigma));
  i.mask = Image<std::uint8_t>(kSide, kSide, 1, 1);
  std::normal_distribution<double> normal(2.0 + bias, sigma);
  for (float& l : i.radiance.samples()) l = static_cast<float>(normal(random));
  return i;
}

// Parts known beforehand. 24000 data: a sum of squares to 2 %, ten standard deviations of it.
TEST(ErrorBudget, TellsNoiseFromWhatTheFitKeepsBeyondIt) {
  std::mt19937 random(4);
  Dataset dataset;
  for (int n = 0; n < 5; ++n) dataset.illuminations.push_back(picture(false, 0.08, 0.04, random));
  for (int n = 0; n < 5; ++n) dataset.illuminations.push_back(picture(true, 0.1, 0.06, random));
  const std::vector<Image<float>> predicted(10, Image<float>(40, 40, kColorChannels, 2.0F));
  const double variance = 0.06 * 0.06 * 40 * 40 * kColorChannels * 5;
  const auto budget = error_budget(dataset, predicted, 0.01, variance);
  ASSERT_TRUE(budget);
  EXPECT_NEAR(budget->noise, 0.06 / 2.1, 0.0006);
  EXPECT_NEAR(budget->model, std::sqrt(std::pow(0.08 / 2.08, 2) - 0.01 * 0.01), 0.001);
  EXPECT_NEAR(budget->undetermined, 0.06 / 2.1, 0.0006);
  EXPECT_NEAR(budget->measured, std::hypot(0.1, 0.06) / 2.1, 0.001);
  EXPECT_NEAR(std::pow(budget->sum(), 2),
              std::pow(budget->noise, 2) + std::pow(budget->model, 2) + 1e-4 +
                  std::pow(budget->undetermined, 2),
              1e-12);
}

// Three quarters of the variance: half the noise, and the root of three quarters of it.
TEST(ErrorBudget, TellsCalibrationFromNoise) {
  std::mt19937 random(4);
  Dataset dataset;
  dataset.illuminations = {picture(false, 0.0, 0.04, random), picture(true, 0.0, 0.04, random)};
  const std::vector<Image<float>> predicted(2, Image<float>(40, 40, kColorChannels, 2.0F));
  const auto whole = error_budget(dataset, predicted, 0.0, 0.0);
  for (Illumination& i : dataset.illuminations) i.calibration_share = 0.75;
  const auto parted = error_budget(dataset, predicted, 0.0, 0.0);
  EXPECT_EQ(whole->calibration, 0.0);
  EXPECT_NEAR(parted->noise, 0.5 * whole->noise, 1e-9);
  EXPECT_NEAR(parted->calibration, std::sqrt(0.75) * whole->noise, 1e-9);
  EXPECT_NEAR(parted->sum(), whole->sum(), 1e-9);
}

TEST(ErrorBudget, CountsNoModelErrorWhereTheFitIsWithinItsNoise) {
  std::mt19937 random(4);
  Dataset dataset;
  dataset.illuminations = {picture(false, 0.0, 0.04, random), picture(true, 0.0, 0.04, random)};
  for (float& v : dataset.illuminations.front().radiance_variance.samples()) v *= 1.2F;
  const std::vector<Image<float>> predicted(2, Image<float>(40, 40, kColorChannels, 2.0F));
  EXPECT_EQ(error_budget(dataset, predicted, 0.0, 0.0)->model, 0.0);
}

TEST(ErrorBudget, IsAbsentWithoutHeldOutLight) {
  std::mt19937 random(4);
  Dataset dataset;
  dataset.illuminations = {picture(false, 0.0, 0.04, random)};
  EXPECT_FALSE(error_budget(dataset, {Image<float>(40, 40, kColorChannels, 2.0F)}, 0.0, 0.0));
}

Material homogeneous(const Block& block) {
  Material material;
  material.block = block;
  material.ior = 1.3;
  for (ChannelCoefficients& c : material.channels)
    c = {std::vector<double>(block.cell_count(), 0.01),
         std::vector<double>(block.cell_count(), 1.0)};
  return material;
}

// Against the change to cells a quarter of the size, which leaves a sixteenth of the error: what Richardson's step from
// one halving promises to 1 / 16, and the scheme's fourth-order terms that it leaves out, allowed for by a quarter.
TEST(ErrorBudget, ForeseesWhatFinerGridsWillChange) {
  const Block block{8, 8, 6, 1.0, 1.0, 1.0};
  const testing_support::SyntheticOptions scene{.block = block};
  Dataset dataset = make_synthetic_dataset(scene);
  for (Illumination& i : dataset.illuminations) i.held_out = true;
  dataset.illuminations.resize(1);
  for (float& e : dataset.illuminations.front().irradiance.samples()) e = 1.0F;
  dataset.view_cosine = Image<float>(8, 8, 1, 1.0F);
  const auto solver = host::make_host_solver({.threads = 2});
  const InverseOptions options{.tolerance = 1e-7};
  const auto error = discretisation_error(dataset, homogeneous(block), options, *solver, {});
  ASSERT_TRUE(error) << error.error().message;
  Dataset fine = dataset;
  fine.block = {32, 32, 24, 0.25, 0.25, 0.25};
  fine.view_cosine = Image<float>(32, 32, 1, 1.0F);
  Illumination& light = fine.illuminations.front();
  light.irradiance = Image<float>(32, 32, kColorChannels, 1.0F);
  light.radiance = Image<float>(32, 32, kColorChannels, 1.0F);
  light.radiance_variance = Image<float>(32, 32, kColorChannels, 1.0F);
  light.mask = Image<std::uint8_t>(32, 32, 1, 1);
  const auto coarse = predict(dataset, homogeneous(block), options, *solver, {});
  const auto finest = predict(fine, homogeneous(fine.block), options, *solver, {});
  ASSERT_TRUE(coarse && finest);
  double change = 0.0;
  double power = 0.0;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      double mean = 0.0;
      for (int v = 0; v < 4; ++v)
        for (int u = 0; u < 4; ++u) mean += (*finest)[0].at(4 * x + u, 4 * y + v, 1) / 16.0;
      change += std::pow((*coarse)[0].at(x, y, 1) - mean, 2);
      power += mean * mean;
    }
  EXPECT_GT(*error, 1e-4);
  EXPECT_NEAR(*error, std::sqrt(change / power), 0.25 * *error);
}

}  // namespace
}  // namespace opaline::reconstruct
