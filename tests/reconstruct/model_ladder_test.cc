#include "reconstruct/model_ladder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "reconstruct/host/host_solver.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing_support::make_synthetic_dataset;
using testing_support::SyntheticOptions;

constexpr int kGreen = 1;

// Pictures come from a grid twice as fine with light put elsewhere (tests/support/synthetic_dataset.h).
SyntheticOptions sample(bool heterogeneous, bool layered) {
  return {
      .block = {12, 12, 8, 0.75, 0.75, 0.75}, .heterogeneous = heterogeneous, .layered = layered};
}

Result<LadderProgress> climb(const Dataset& dataset, const InverseOptions& options = {}) {
  const auto solver = host::make_host_solver({.threads = 1});
  const SystemClock clock;
  auto models = ModelLadder::create(dataset,
                                    kGreen,
                                    options,
                                    *solver,
                                    clock,
                                    {[](const ChannelReport&, std::size_t, std::size_t) {},
                                     [](const LadderProgress&) { return ok(); }});
  if (!models) return models.error();
  return models->run(std::nullopt, {});
}

// Other noise of the same size on pictures made without.
Dataset with_noise(Dataset dataset, double relative, unsigned seed) {
  std::mt19937 random(seed);
  for (Illumination& i : dataset.illuminations) {
    auto radiance = i.radiance.samples();
    const float brightest = *std::max_element(radiance.begin(), radiance.end());
    for (std::size_t s = 0; s < radiance.size(); ++s) {
      const double sigma = relative * std::hypot(radiance[s], 0.1 * brightest);
      i.radiance_variance.samples()[s] = static_cast<float>(sigma * sigma);
      radiance[s] += static_cast<float>(std::normal_distribution<double>(0.0, sigma)(random));
    }
  }
  return dataset;
}

TEST(ModelLadder, LeavesAHomogeneousSampleAtTwoNumbersWhateverTheNoise) {
  SyntheticOptions options = sample(false, false);
  options.noise = 0.0;
  const Dataset clean = make_synthetic_dataset(options);
  for (const double noise : {0.003, 0.01, 0.05}) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      const auto climbed = climb(with_noise(clean, noise, seed));
      ASSERT_TRUE(climbed) << climbed.error().message;
      EXPECT_EQ(climbed->report.model, "homogeneous") << noise << ", seed " << seed;
      EXPECT_THAT(climbed->report.model_reason, HasSubstr("explained"));
      EXPECT_TRUE(climbed->report.homogeneous.absorption_interval);
    }
  }
}

TEST(ModelLadder, StopsALayeredSampleOnLayers) {
  const auto climbed = climb(make_synthetic_dataset(sample(false, true)));
  ASSERT_TRUE(climbed) << climbed.error().message;
  EXPECT_EQ(climbed->report.model, "layered");
  ASSERT_EQ(climbed->report.ladder.size(), 2U);
  EXPECT_GT(climbed->report.ladder[0].held_out, 1.0 + climbed->report.ladder[0].standard_error);
  EXPECT_THAT(climbed->report.model_reason, HasSubstr("explained"));
  const Block block = sample(false, true).block;
  const double lit = climbed->best[block.index(5, 5, 1)];
  const double seen = climbed->best[block.index(5, 5, 6)];
  EXPECT_EQ(lit, climbed->best[block.index(0, 11, 1)]);
  EXPECT_GT(lit, seen);  // the half at the camera scatters less
}

TEST(ModelLadder, TakesAVeinedSampleToItsCells) {
  const auto climbed = climb(make_synthetic_dataset(sample(true, false)));
  ASSERT_TRUE(climbed) << climbed.error().message;
  EXPECT_THAT(climbed->report.model, StartsWith("heterogeneous"));
  const ModelReport& last = climbed->report.ladder.back();
  EXPECT_LT(last.held_out, 0.2 * climbed->report.ladder.front().held_out);
  EXPECT_GT(last.gain, last.gain_error);
  EXPECT_THAT(last.why, HasSubstr("falls"));
}

TEST(ModelLadder, KeepsSomeOfTheFitsLightsOutWhereTheDatasetHasNone) {
  Dataset dataset = make_synthetic_dataset(sample(false, true));
  std::erase_if(dataset.illuminations, [](const Illumination& i) { return i.held_out; });
  const auto climbed = climb(dataset);
  ASSERT_TRUE(climbed) << climbed.error().message;
  EXPECT_TRUE(climbed->report.cross_validated);
  EXPECT_EQ(climbed->report.model, "layered");
  EXPECT_EQ(climbed->report.data_count, 9U * 144U);  // all have their say in the end
}

TEST(ModelLadder, TakesEveryCellWhereNothingCanBeHeldOut) {
  Dataset dataset = make_synthetic_dataset(sample(false, false));
  dataset.illuminations.resize(2);
  const auto climbed = climb(dataset);
  ASSERT_TRUE(climbed) << climbed.error().message;
  EXPECT_EQ(climbed->report.model, "heterogeneous");
  EXPECT_THAT(climbed->report.model_reason, HasSubstr("too few illuminations"));
}

TEST(ModelLadder, TakesTheModelThatIsAskedFor) {
  const Dataset dataset = make_synthetic_dataset(sample(true, false));
  InverseOptions options;
  options.model = Model::kHomogeneous;
  const auto homogeneous = climb(dataset, options);
  options.model = Model::kLayered;
  const auto layered = climb(dataset, options);
  ASSERT_TRUE(homogeneous && layered);
  EXPECT_EQ(homogeneous->report.model, "homogeneous");
  EXPECT_EQ(layered->report.model, "layered");
  EXPECT_EQ(layered->report.model_reason, "the model was asked for");
}

}  // namespace
}  // namespace opaline::reconstruct
