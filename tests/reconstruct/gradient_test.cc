#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/objective.h"
#include "tests/reconstruct/support/random_problem.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

using namespace testing_problem;  // NOLINT(google-build-using-namespace)

class Gradient : public testing::TestWithParam<Case> {
 protected:
  double value(std::span<const double> p) { return objective_.evaluate(p, {})->value; }

  // Richardson: (8 (J(h) - J(-h)) - (J(2h) - J(-2h))) / 12 h, error O(h^4).
  double difference(std::vector<double> p, std::size_t i, double h) {
    const double at = p[i];
    const auto moved = [&](double step) {
      p[i] = at + step;
      return value(p);
    };
    return (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
  }

  ChannelProblem problem_ = random_problem(GetParam());
  testing_support::DirectSolver solver_;
  Objective objective_{
      problem_,
      solver_,
      {.regularization = GetParam().regularization, .regularizer = GetParam().regularizer}};
};

// Each component against its own size. h = 2e-3 leaves h^4 = 2e-11 of truncation; the rounding of J, 1e-15 of it, is
// divided by h and must stay 1e-6 of the component, so a component is resolved from 1e-6 J on.
TEST_P(Gradient, MatchesRichardsonDifferencesInEveryParameter) {
  const std::size_t cells = problem_.block.cell_count();
  const std::vector<double> p = to_parameters(random_medium(cells, 3));
  const Evaluation at = *objective_.evaluate(p, {});
  const double resolved = 1e-6 * at.value;
  double worst = 0.0;
  std::size_t unresolved = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double expected = difference(p, i, 2e-3);
    unresolved += std::abs(expected) < resolved ? 1 : 0;
    const double error = std::abs(at.gradient[i] - expected);
    worst = std::max(worst, error / std::max(std::abs(expected), resolved));
    EXPECT_LE(error, 1e-6 * std::max(std::abs(expected), resolved)) << "parameter " << i;
  }
  std::printf("worst component: %.1e of itself; %zu of %zu too small to tell\n",
              worst,
              unresolved,
              p.size());
  EXPECT_LE(unresolved, p.size() / 50);
}

INSTANTIATE_TEST_SUITE_P(Light, Gradient, kEveryLight, case_name);
INSTANTIATE_TEST_SUITE_P(Rays, Gradient, kEveryLightAlongRays, case_name);

}  // namespace
}  // namespace opaline::reconstruct
