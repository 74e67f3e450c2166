#include "reconstruct/model_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/illumination_subset.h"

namespace opaline::reconstruct {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> names(Model choice, const Block& block) {
  std::vector<std::string> out;
  for (const ModelRung& rung : models_to_try(choice, block, Face::kZMin)) out.push_back(rung.name);
  return out;
}

TEST(ModelChoice, ClimbsFromTheSimplestAndLeavesOutWhatIsNoFiner) {
  EXPECT_THAT(
      names(Model::kAuto, {12, 12, 6, 1, 1, 1}),
      ElementsAre(
          "homogeneous", "layered", "heterogeneous, a node every 4 cells", "heterogeneous"));
  EXPECT_THAT(names(Model::kAuto, {4, 3, 2, 1, 1, 1}),
              ElementsAre("homogeneous", "layered", "heterogeneous"));
  EXPECT_THAT(names(Model::kAuto, {1, 1, 5, 1, 1, 1}), ElementsAre("homogeneous", "layered"));
  EXPECT_THAT(names(Model::kAuto, {1, 1, 1, 1, 1, 1}), ElementsAre("homogeneous"));
  EXPECT_THAT(names(Model::kHeterogeneous, {8, 8, 4, 1, 1, 1}),
              ElementsAre("homogeneous", "heterogeneous"));
}

// Pictures of two cells each, all weights 1, a radiance of zero: a model's chi^2 is its own squares.
ChannelProblem dark_problem(std::size_t pictures) {
  ChannelProblem problem;
  for (std::size_t m = 0; m < pictures; ++m) {
    problem.illuminations.push_back({{}, {0.0, 0.0}, {1.0, 1.0}, 0.0});
    problem.data_count += 2;
  }
  return problem;
}

// By hand: chi^2 = 2, 8 and 18 over 2 data each, mean 28 / 6; differences to a model that is dark: the same.
// Blocks: 3/2 sum (chi^2_m - 2 mean)^2 / 36 = 3/2 (7.333^2 + 1.333^2 + 8.667^2) / 36.
TEST(ModelChoice, EstimatesItsErrorsFromTheScatterBetweenPictures) {
  const ChannelProblem problem = dark_problem(3);
  const Misfit bright = misfit(problem, {{1, 1}, {2, 2}, {3, 3}});
  const Misfit dark = misfit(problem, {{0, 0}, {0, 0}, {0, 0}});
  const double blocks = std::sqrt(1.5 * (53.778 + 1.778 + 75.111) / 36.0);
  EXPECT_NEAR(bright.per_datum(), 28.0 / 6.0, 1e-12);
  EXPECT_NEAR(bright.standard_error(), blocks, 1e-3);
  const Gain gained = gain(problem, bright, dark);
  EXPECT_NEAR(gained.per_datum, 28.0 / 6.0, 1e-12);
  EXPECT_NEAR(gained.standard_error, blocks, 1e-3);
  EXPECT_TRUE(gained.is_significant());
  EXPECT_FALSE(gain(problem, dark, bright).is_significant());
}

// One picture has no scatter: independent data give 2 sqrt(sum of the squares) / N.
TEST(ModelChoice, FallsBackOnTheDataWhereThereIsOnePicture) {
  const ChannelProblem problem = dark_problem(1);
  const Gain gained = gain(problem, misfit(problem, {{3, 4}}), misfit(problem, {{0, 0}}));
  EXPECT_NEAR(gained.standard_error, 2.0 * 5.0 / 2.0, 1e-12);
  EXPECT_NEAR(misfit(problem, {{3, 4}}).standard_error(), 1.0, 1e-12);
}

TEST(ModelChoice, CountsAModelAsExplainingUpToOneStandardErrorAboveTheNoise) {
  const ChannelProblem problem = dark_problem(1);
  EXPECT_TRUE(is_explained(misfit(problem, {{std::sqrt(2.0), std::sqrt(1.9)}})));
  EXPECT_FALSE(is_explained(misfit(problem, {{std::sqrt(2.0), std::sqrt(2.1)}})));
}

TEST(IlluminationSubset, KeepsEveryFourthOutAndCountsAgain) {
  const ValidationSplit nine = split_for_validation(dark_problem(9));
  EXPECT_EQ(nine.held_out.illuminations.size(), 2U);
  EXPECT_EQ(nine.fit.data_count, 14U);
  EXPECT_EQ(nine.held_out.data_count, 4U);
  EXPECT_EQ(split_for_validation(dark_problem(3)).held_out.illuminations.size(), 1U);
  EXPECT_EQ(split_for_validation(dark_problem(2)).held_out.illuminations.size(), 0U);
  EXPECT_THAT(few_illuminations(dark_problem(16), 4), ElementsAre(0, 5, 10, 15));
  EXPECT_THAT(few_illuminations(dark_problem(3), 4), ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace opaline::reconstruct
