#include "reconstruct/homogeneous_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruct/diffusion/reference_solver.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

constexpr int kRepetitions = 120;

struct Truth {
  double reduced_scattering = 1.2;
  double absorption = 0.02;
};

/// Pictures of a homogeneous block by the very model that is fitted: what is left is noise and what is put on top.
class Experiment {
 public:
  Experiment(const Truth& truth, double model_error) : truth_(truth), model_error_(model_error) {
    options_.model_error = model_error;
    Dataset dataset = testing_support::make_synthetic_dataset(
        {.block = {6, 6, 4, 1.0, 1.0, 1.0}, .regions = 2, .noise = 0.01, .heterogeneous = false});
    problem_ = *make_channel_problem(dataset, 0, options_, Selection::kFit);
    Objective objective(problem_, *solver_, {1e-8, 0.0});
    const std::size_t cells = problem_.block.cell_count();
    exact_ = *objective.predict({std::vector<double>(cells, truth.absorption),
                                 std::vector<double>(cells, truth.reduced_scattering)},
                                {});
  }

  // Noise of 2 % of each datum and of the brightest's tenth; the model's error is the same in all pictures.
  HomogeneousFit fit_once(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const double in_proportion = model_error_ * normal(random);
    const double everywhere = model_error_ * normal(random);
    for (std::size_t m = 0; m < exact_.size(); ++m) {
      ChannelIllumination& data = problem_.illuminations[m];
      double level = 0.0;
      for (const double l : exact_[m]) level += l * l / static_cast<double>(exact_[m].size());
      level = std::sqrt(level);
      for (std::size_t x = 0; x < exact_[m].size(); ++x) {
        const double l = exact_[m][x];
        const double sigma = 0.02 * std::hypot(l, 0.3 * level);
        data.radiance[x] = l + sigma * normal(random) + in_proportion * l + everywhere * level;
        data.weight[x] =
            1.0 / (sigma * sigma + model_error_ * model_error_ * (l * l + level * level));
      }
    }
    HomogeneousFit start;
    start.reduced_scattering = truth_.reduced_scattering;
    start.absorption = truth_.absorption;
    auto fit = refine_homogeneous(problem_, options_, start, *solver_, {});
    EXPECT_TRUE(fit) << fit.error().message;
    return fit ? *fit : start;
  }

  struct Coverage {
    double reduced_scattering = 0.0;
    double absorption = 0.0;
  };
  Coverage coverage() {
    std::mt19937 random(7);
    Coverage share;
    const auto holds = [](const std::optional<Interval>& i, double value) {
      return i && i->lowest <= value && value <= i->highest ? 1.0 / kRepetitions : 0.0;
    };
    for (int n = 0; n < kRepetitions; ++n) {
      const HomogeneousFit fit = fit_once(random);
      share.reduced_scattering += holds(fit.reduced_scattering_interval, truth_.reduced_scattering);
      share.absorption += holds(fit.absorption_interval, truth_.absorption);
    }
    return share;
  }

 private:
  Truth truth_;
  double model_error_;
  InverseOptions options_;
  std::unique_ptr<diffusion::FluenceSolver> solver_ = diffusion::make_reference_solver();
  ChannelProblem problem_;
  std::vector<std::vector<double>> exact_;
};

// The data are the fine grid's own, so its minimum is the truth; cells twice as long in each direction have another.
TEST(HomogeneousFit, EndsAtTheMinimumOfAFineGridWithFewSolvesOnIt) {
  const InverseOptions options;
  Dataset dataset = testing_support::make_synthetic_dataset(
      {.block = {9, 9, 6, 2.0, 2.0, 2.0}, .regions = 2, .noise = 0.01, .heterogeneous = false});
  dataset.block = {36, 36, 18, 0.5, 0.5, 0.5};
  dataset.view_cosine = Image<float>(36, 36, 1, 1.0F);
  for (Illumination& i : dataset.illuminations) {
    Image<float> irradiance(36, 36, kColorChannels);
    for (int y = 0; y < 36; ++y)
      for (int x = 0; x < 36; ++x) irradiance.at(x, y, 0) = i.irradiance.at(x / 4, y / 4, 0);
    i.irradiance = std::move(irradiance);
    i.radiance = Image<float>(36, 36, kColorChannels, 1.0F);
    i.radiance_variance = Image<float>(36, 36, kColorChannels, 1.0F);
    i.mask = Image<std::uint8_t>(36, 36, 1, 1);
  }
  auto problem = make_channel_problem(dataset, 0, options, Selection::kFit);
  ASSERT_TRUE(problem) << problem.error().message;
  const auto solver = diffusion::make_reference_solver();
  const Truth truth;
  const std::size_t cells = problem->block.cell_count();
  const auto exact = Objective(*problem, *solver, {1e-8, 0.0})
                         .predict({std::vector<double>(cells, truth.absorption),
                                   std::vector<double>(cells, truth.reduced_scattering)},
                                  {});
  ASSERT_TRUE(exact) << exact.error().message;
  for (std::size_t m = 0; m < exact->size(); ++m) {
    ChannelIllumination& data = problem->illuminations[m];
    data.radiance = (*exact)[m];
    for (std::size_t x = 0; x < data.weight.size(); ++x)
      data.weight[x] = std::pow(0.02 * data.radiance[x], -2.0);
  }

  const auto fit = fit_homogeneous(*problem, options, *solver, {});

  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_NEAR(fit->reduced_scattering / truth.reduced_scattering, 1.0, 2e-3);
  EXPECT_NEAR(fit->absorption / truth.absorption, 1.0, 4e-3);
  EXPECT_LT(fit->solves, 5 * 16);  // a table of starts on the fine grid takes 4 * 16
}

// A thin block that absorbs and a thick one that does not are minima of one objective; whatever the truth is, the fit
// ends there, in the table of starts or between. Of the darkest block only a millionth of the light comes through, which the
// solves hardly tell: there it is the minimum that counts (the other one is at a twentieth).
TEST(HomogeneousFit, EndsInTheLowerOfTwoMinima) {
  const InverseOptions options;
  const Dataset dataset = testing_support::make_synthetic_dataset(
      {.block = {8, 8, 8, 0.75, 0.75, 0.75}, .regions = 2, .heterogeneous = false});
  const auto solver = diffusion::make_reference_solver();
  auto problem = make_channel_problem(dataset, 0, options, Selection::kFit);
  ASSERT_TRUE(problem) << problem.error().message;
  const std::size_t cells = problem->block.cell_count();
  for (const double scattering : {0.4, 1.35, 4.0})
    for (const double ratio : {1e-3, 1e-2, 1e-1}) {
      const auto exact = Objective(*problem, *solver, {1e-8, 0.0})
                             .predict({std::vector<double>(cells, ratio * scattering),
                                       std::vector<double>(cells, scattering)},
                                      {});
      ASSERT_TRUE(exact) << exact.error().message;
      for (std::size_t m = 0; m < exact->size(); ++m) {
        ChannelIllumination& data = problem->illuminations[m];
        data.radiance = (*exact)[m];
        double square = 0.0;
        for (const double l : data.radiance) square += l * l;
        square /= static_cast<double>(data.radiance.size());
        for (std::size_t x = 0; x < data.weight.size(); ++x)
          data.weight[x] = 1e4 / (data.radiance[x] * data.radiance[x] + square);
      }
      const auto fit = fit_homogeneous(*problem, options, *solver, {});
      ASSERT_TRUE(fit) << fit.error().message;
      const double tolerance = scattering * ratio < 0.3 ? 0.02 : 0.25;
      EXPECT_NEAR(fit->reduced_scattering / scattering, 1.0, tolerance)
          << scattering << ", " << ratio;
    }
}

// Where a checkerboard that no homogeneous block makes is most of chi^2, the other minimum is no more than twice as high.
TEST(HomogeneousFit, NamesTheOtherMinimumThatThePicturesHardlyRuleOut) {
  const InverseOptions options;
  const Dataset dataset = testing_support::make_synthetic_dataset(
      {.block = {8, 8, 8, 0.75, 0.75, 0.75}, .regions = 2, .heterogeneous = false});
  const auto solver = diffusion::make_reference_solver();
  auto problem = make_channel_problem(dataset, 0, options, Selection::kFit);
  ASSERT_TRUE(problem) << problem.error().message;
  const std::size_t cells = problem->block.cell_count();
  const auto exact =
      Objective(*problem, *solver, {1e-8, 0.0})
          .predict({std::vector<double>(cells, 0.4), std::vector<double>(cells, 4.0)}, {});
  ASSERT_TRUE(exact) << exact.error().message;
  for (std::size_t m = 0; m < exact->size(); ++m) {
    ChannelIllumination& data = problem->illuminations[m];
    for (std::size_t x = 0; x < data.weight.size(); ++x) {
      const double sign = (x % 8 + x / 8) % 2 == 0 ? 1.0 : -1.0;
      data.radiance[x] = (*exact)[m][x] * (1.0 + 0.3 * sign);
      data.weight[x] = std::pow(0.02 * (*exact)[m][x], -2.0);
    }
  }

  const auto veined = fit_homogeneous(*problem, options, *solver, {});

  ASSERT_TRUE(veined) << veined.error().message;
  ASSERT_FALSE(veined->rivals.empty());
  const auto& rival = veined->rivals.front();
  problem->start = rival;
  const auto there = fit_homogeneous(*problem, options, *solver, {});
  ASSERT_TRUE(there) << there.error().message;
  EXPECT_GT(there->reduced_scattering, 2.0 * veined->reduced_scattering);
  EXPECT_GT(there->chi_squared, veined->chi_squared);
  EXPECT_LT(there->chi_squared, 2.0 * veined->chi_squared);
}

// 120 draws of probability 0.95: 0.90 to 0.99 is two and a half standard deviations below and two above.
TEST(HomogeneousFit, HoldsTheTruthIn95Of100IntervalsUnderNoise) {
  const auto share = Experiment({}, 0.0).coverage();
  EXPECT_GE(share.reduced_scattering, 0.90);
  EXPECT_LE(share.reduced_scattering, 0.99);
  EXPECT_GE(share.absorption, 0.90);
  EXPECT_LE(share.absorption, 0.99);
}

TEST(HomogeneousFit, HoldsTheTruthIn95Of100IntervalsWhereTheModelErrsInEveryPicture) {
  const auto share = Experiment({}, 0.03).coverage();
  EXPECT_GE(share.reduced_scattering, 0.90);
  EXPECT_LE(share.reduced_scattering, 0.99);
  EXPECT_GE(share.absorption, 0.90);
  EXPECT_LE(share.absorption, 0.99);
}

// Absorption at its bound: the estimate is one-sided, so more than 95 of 100 may hold it, never fewer.
TEST(HomogeneousFit, BoundsAbsorptionThatCannotBeToldFromNone) {
  std::mt19937 random(3);
  Experiment experiment({1.2, 1e-5}, 0.0);
  const HomogeneousFit fit = experiment.fit_once(random);
  ASSERT_TRUE(fit.absorption_interval);
  EXPECT_EQ(fit.absorption_interval->lowest, 0.0);
  EXPECT_GT(fit.absorption_interval->highest, 1e-5);
  EXPECT_LT(fit.absorption_interval->highest, 0.01);  // it is known to be small
}

}  // namespace
}  // namespace opaline::reconstruct
