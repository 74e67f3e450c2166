#include "reconstruct/gauss_newton.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "reconstruct/objective.h"
#include "tests/reconstruct/support/random_problem.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

// Rosenbrock's valley as least squares, r = (1 - x0, 10 (x1 - x0^2)): value r^2, H = 2 J^T J.
Result<Evaluation> rosenbrock(std::span<const double> x, std::stop_token /*stop*/) {
  const double a = 1.0 - x[0];
  const double b = x[1] - x[0] * x[0];
  Evaluation e;
  e.value = a * a + 100.0 * b * b;
  e.gradient = {-2.0 * a - 400.0 * x[0] * b, 200.0 * b};
  return e;
}

HessianProduct hessian_at(const std::vector<double>& x, int* products = nullptr) {
  return [x0 = x[0], products](std::span<const double> v,
                               const std::stop_token&) -> Result<std::vector<double>> {
    if (products != nullptr) ++*products;
    const double j1 = -20.0 * x0 * v[0] + 10.0 * v[1];
    return std::vector<double>{2.0 * v[0] + 2.0 * -20.0 * x0 * j1, 2.0 * 10.0 * j1};
  };
}

LbfgsState start(std::vector<double> x) {
  LbfgsState state;
  state.at = *rosenbrock(x, {});
  state.x = std::move(x);
  return state;
}

int minimise(LbfgsState& state, const Bounds& bounds) {
  int steps = 0;
  while (steps < 200) {
    const double before = state.at.value;
    const auto outcome = gauss_newton_step(state, bounds, {}, rosenbrock, hessian_at(state.x), {});
    if (!outcome || *outcome == StepOutcome::kNoDescent) break;
    EXPECT_LT(state.at.value, before);
    ++steps;
  }
  return steps;
}

TEST(GaussNewton, FindsTheBottomOfACurvedValleyInAFewSteps) {
  LbfgsState state = start({-1.2, 1.0});
  EXPECT_LT(minimise(state, {{-10, -10}, {10, 10}}), 40);
  EXPECT_NEAR(state.x[0], 1.0, 1e-6);
  EXPECT_NEAR(state.x[1], 1.0, 1e-6);
}

TEST(GaussNewton, StopsAtABoundThatTheMinimumLiesBeyond) {
  LbfgsState state = start({-1.2, 1.0});
  minimise(state, {{-10, -10}, {0.5, 10}});
  EXPECT_EQ(state.x[0], 0.5);
  EXPECT_NEAR(state.x[1], 0.25, 1e-5);
}

// Far away half of the gradient will do: one of the two products that solve this system exactly.
TEST(GaussNewton, SolvesNoMoreExactlyThanItsForcingTermAsks) {
  LbfgsState state = start({-1.2, 1.0});
  int products = 0;
  ASSERT_TRUE(gauss_newton_step(
      state, {{-10, -10}, {10, 10}}, {}, rosenbrock, hessian_at(state.x, &products), {}));
  EXPECT_EQ(products, 1);
}

TEST(GaussNewton, SaysSoAtAMinimum) {
  LbfgsState state = start({1.0, 1.0});
  EXPECT_EQ(
      *gauss_newton_step(state, {{-10, -10}, {10, 10}}, {}, rosenbrock, hessian_at(state.x), {}),
      StepOutcome::kNoDescent);
}

// Where the data are met exactly and nothing varies, Gauss-Newton leaves nothing out: the product is the derivative of
// the exact gradient. Central differences of step 1e-3 leave 1e-6 of truncation.
class Hessian : public testing::TestWithParam<testing_problem::Case> {};

TEST_P(Hessian, IsTheGradientsDerivativeWhereTheDataAreMet) {
  ChannelProblem problem = testing_problem::random_problem(GetParam());
  testing_support::DirectSolver solver;
  Objective objective(
      problem,
      solver,
      {.regularization = GetParam().regularization, .regularizer = GetParam().regularizer});
  const std::size_t cells = problem.block.cell_count();
  const ChannelCoefficients truth{std::vector<double>(cells, 0.05),
                                  std::vector<double>(cells, 1.5)};
  const auto pictures = *objective.predict(truth, {});
  for (std::size_t m = 0; m < pictures.size(); ++m) problem.illuminations[m].radiance = pictures[m];
  const std::vector<double> p = to_parameters(truth);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<double> v(p.size());
  for (double& value : v) value = normal(random);
  auto tangent = objective.tangent(p, {});
  ASSERT_TRUE(tangent);
  const std::vector<double> product = *objective.hessian_product(*tangent, v, {});
  const auto gradient_at = [&](double t) {
    std::vector<double> moved = p;
    for (std::size_t i = 0; i < p.size(); ++i) moved[i] += t * v[i];
    return objective.evaluate(moved, {})->gradient;
  };
  constexpr double kStep = 1e-3;
  const std::vector<double> above = gradient_at(kStep);
  const std::vector<double> below = gradient_at(-kStep);
  double off = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double difference = (above[i] - below[i]) / (2.0 * kStep);
    off += std::pow(product[i] - difference, 2);
    all += std::pow(difference, 2);
  }
  EXPECT_LT(std::sqrt(off / all), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Light, Hessian, testing_problem::kEveryLight, testing_problem::case_name);
INSTANTIATE_TEST_SUITE_P(Rays,
                         Hessian,
                         testing_problem::kEveryLightAlongRays,
                         testing_problem::case_name);

}  // namespace
}  // namespace opaline::reconstruct
