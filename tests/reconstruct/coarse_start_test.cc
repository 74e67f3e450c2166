#include "reconstruct/coarse_start.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/coarse_grid.h"
#include "reconstruct/diffusion/reference_solver.h"

namespace opaline::reconstruct {
namespace {

constexpr Block kBlock{12, 10, 8, 0.4, 0.4, 0.4};

// A heterogeneous sample's own pictures under two lights, each datum weighted as of this relative error.
class CoarseStart : public testing::Test {
 protected:
  CoarseStart() {
    for (std::size_t i = 0; i < kBlock.cell_count(); ++i) {
      const double x = static_cast<double>(i % kBlock.nx);
      truth_.reduced_scattering.push_back(1.0 + 0.3 * std::sin(0.5 * x));
      truth_.absorption.push_back(0.02);
    }
  }

  ChannelProblem problem_of(double relative_error) {
    const std::size_t face = kBlock.face_cell_count(Face::kZMax);
    const auto boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3);
    ChannelProblem problem{
        .block = kBlock,
        .boundary = boundary,
        .source = {},
        .camera = std::vector(face, diffusion::camera_equation(1.3, boundary, 1.0)),
        .rays = {},
        .illuminations = std::vector<ChannelIllumination>(2),
        .data_count = 2 * face};
    for (std::size_t m = 0; m < 2; ++m) {
      auto& q = problem.illuminations[m].irradiance;
      q.assign(face, 0.0);
      for (std::size_t f = 0; f < face; ++f) q[f] = (f % kBlock.nx < 6) == (m == 0) ? 1.0 : 0.0;
    }
    const auto pictures = *Objective(problem, *solver_, {}).predict(truth_, {});
    for (std::size_t m = 0; m < 2; ++m) {
      problem.illuminations[m].radiance = pictures[m];
      for (const double l : pictures[m])
        problem.illuminations[m].weight.push_back(1.0 / std::pow(relative_error * l, 2));
    }
    return problem;
  }

  Result<ChannelSolver::WarmStart> start(const ChannelProblem& problem,
                                         const std::optional<ChannelSolver::WarmStart>& from) {
    return coarse_start(
        problem, *coarser_block(kBlock), {}, from, /*try_rivals=*/true, *solver_, clock_, {});
  }

  static ChannelSolver::WarmStart constant(const HomogeneousFit& fit) {
    const std::size_t cells = kBlock.cell_count();
    return {fit,
            to_parameters({std::vector<double>(cells, fit.absorption),
                           std::vector<double>(cells, fit.reduced_scattering)})};
  }

  double chi_squared(const ChannelProblem& problem, const ChannelSolver::WarmStart& warm) {
    return Objective(problem, *solver_, {}).evaluate(warm.cell_values, {})->chi_squared;
  }

  std::unique_ptr<diffusion::FluenceSolver> solver_ = diffusion::make_reference_solver();
  SystemClock clock_;
  ChannelCoefficients truth_;
};

TEST_F(CoarseStart, LeavesAnAnswerAloneThatExplainsThePictures) {
  const ChannelProblem problem = problem_of(0.2);
  const ChannelSolver::WarmStart known{{}, to_parameters(truth_), 7};
  const auto warm = start(problem, known);
  ASSERT_TRUE(warm) << warm.error().message;
  EXPECT_EQ(warm->cell_values, known.cell_values);
  EXPECT_GT(warm->solves, 7);
}

TEST_F(CoarseStart, BringsWhatTheCoarseGridFoundToTheFineOne) {
  const ChannelProblem problem = problem_of(0.01);
  const auto warm = start(problem, std::nullopt);
  ASSERT_TRUE(warm) << warm.error().message;
  EXPECT_LT(chi_squared(problem, *warm), chi_squared(problem, constant(warm->homogeneous)));
  EXPECT_FALSE(warm->pairs.empty());
}

// From a block that no light comes through there is no way down.
TEST_F(CoarseStart, GoesOnFromTheRivalThatTheVeinsAreAbout) {
  const ChannelProblem problem = problem_of(0.01);
  HomogeneousFit dark{.reduced_scattering = 60.0, .absorption = 5.0};
  const auto alone = start(problem, constant(dark));
  dark.rivals = {{30.0, 9.0}, {1.0, 0.02}};
  const auto one_of_three = start(problem, constant(dark));
  ASSERT_TRUE(alone && one_of_three);
  EXPECT_LT(20.0 * chi_squared(problem, *one_of_three), chi_squared(problem, *alone));
  EXPECT_NEAR(one_of_three->cell_values.front(), 0.0, 0.5);
  EXPECT_GT(one_of_three->solves, alone->solves);
}

}  // namespace
}  // namespace opaline::reconstruct
