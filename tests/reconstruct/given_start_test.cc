#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/homogeneous_fit.h"
#include "reconstruct/illumination_subset.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

struct Start {
  double scattering_factor = 1.0;  ///< over what a fit without a start finds
  double absorption_factor = 1.0;
};

class GivenStart : public ::testing::Test {
 protected:
  HomogeneousFit fit(std::optional<StartCoefficients> start) {
    problem_.start = start;
    const auto solver = diffusion::make_reference_solver();
    auto found = fit_homogeneous(problem_, options_, *solver, {});
    EXPECT_TRUE(found) << found.error().message;
    return *found;
  }

  InverseOptions options_;
  ChannelProblem problem_ = *make_channel_problem(
      testing_support::make_synthetic_dataset(
          {.block = {8, 8, 5, 1.0, 1.0, 1.0}, .regions = 2, .noise = 0.01, .heterogeneous = true}),
      1,
      options_,
      Selection::kFit);
};

// What a sphere of lights says is within 15 % (docs/physics.md): D and sigma_s' by as much, sigma_a by as much.
TEST_F(GivenStart, AnEstimateWithinFifteenPercentNeedsFewerSolvesThanNone) {
  const HomogeneousFit cold = fit(std::nullopt);
  long most = 0;
  for (const Start& off : {Start{1.0, 1.0}, {1.15, 1.15}, {0.87, 1.15}, {1.15, 0.87}}) {
    const HomogeneousFit warm = fit(StartCoefficients{
        off.scattering_factor * cold.reduced_scattering, off.absorption_factor * cold.absorption});
    EXPECT_NEAR(warm.reduced_scattering / cold.reduced_scattering, 1.0, 0.02);
    EXPECT_NEAR(warm.absorption / cold.absorption, 1.0, 0.05);
    most = std::max(most, warm.solves);
  }
  std::printf("solves: %ld without a start, at most %ld with one\n", cold.solves, most);
  EXPECT_LT(most, cold.solves);
}

TEST_F(GivenStart, GoesWithThePicturesThatAreTakenOut) {
  problem_.start = StartCoefficients{1.0, 0.01};
  EXPECT_TRUE(with_illuminations(problem_, {0, 1}).start);
}

TEST_F(GivenStart, AWrongOneOnlyCostsSolves) {
  const HomogeneousFit cold = fit(std::nullopt);
  const HomogeneousFit wrong =
      fit(StartCoefficients{3.0 * cold.reduced_scattering, 4.0 * cold.absorption});
  EXPECT_NEAR(wrong.reduced_scattering / cold.reduced_scattering, 1.0, 0.02);
}

}  // namespace
}  // namespace opaline::reconstruct
