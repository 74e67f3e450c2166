#include "reconstruct/lbfgs.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::reconstruct {
namespace {

// Rosenbrock's valley, minimum 0 at (1, 1).
Result<Evaluation> rosenbrock(std::span<const double> x, std::stop_token /*stop*/) {
  const double a = 1.0 - x[0];
  const double b = x[1] - x[0] * x[0];
  Evaluation e;
  e.value = a * a + 100.0 * b * b;
  e.gradient = {-2.0 * a - 400.0 * x[0] * b, 200.0 * b};
  return e;
}

LbfgsState start(const ObjectiveFunction& f, std::vector<double> x) {
  LbfgsState state;
  state.at = *f(x, {});
  state.x = std::move(x);
  return state;
}

int minimise(LbfgsState& state, const Bounds& bounds, const ObjectiveFunction& f) {
  int steps = 0;
  while (steps < 200) {
    const double before = state.at.value;
    const auto outcome = lbfgs_step(state, bounds, {}, f, {});
    if (!outcome || *outcome == StepOutcome::kNoDescent) break;
    EXPECT_LT(state.at.value, before);
    ++steps;
  }
  return steps;
}

TEST(Lbfgs, FindsTheBottomOfACurvedValley) {
  LbfgsState state = start(rosenbrock, {-1.2, 1.0});
  const int steps = minimise(state, {{-10, -10}, {10, 10}}, rosenbrock);
  EXPECT_LT(steps, 100);
  EXPECT_NEAR(state.x[0], 1.0, 1e-6);
  EXPECT_NEAR(state.x[1], 1.0, 1e-6);
}

// With x0 <= 0.5 the minimum lies at the bound: (0.5, 0.25), where the slope along x0 points outwards.
TEST(Lbfgs, StopsAtABoundThatTheMinimumLiesBeyond) {
  LbfgsState state = start(rosenbrock, {-1.2, 1.0});
  minimise(state, {{-10, -10}, {0.5, 10}}, rosenbrock);
  EXPECT_EQ(state.x[0], 0.5);
  EXPECT_NEAR(state.x[1], 0.25, 1e-5);
}

TEST(Lbfgs, SaysSoAtAMinimum) {
  LbfgsState state = start(rosenbrock, {1.0, 1.0});
  EXPECT_EQ(*lbfgs_step(state, {{-10, -10}, {10, 10}}, {}, rosenbrock, {}),
            StepOutcome::kNoDescent);
}

TEST(Lbfgs, LeavesTheStateWhenTheObjectiveFails) {
  LbfgsState state = start(rosenbrock, {-1.2, 1.0});
  const auto failing = [](std::span<const double>, std::stop_token) -> Result<Evaluation> {
    return cancelled("asked to");
  };
  const auto outcome = lbfgs_step(state, {{-10, -10}, {10, 10}}, {}, failing, {});
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(state.x, (std::vector<double>{-1.2, 1.0}));
}

// Where the objective is not defined the step is shortened.
TEST(Lbfgs, BacksOutOfARegionWithoutAValue) {
  const auto logarithm = [](std::span<const double> x, std::stop_token) -> Result<Evaluation> {
    Evaluation e;
    e.value = x[0] < 1.5 ? x[0] - std::log(x[0]) : std::nan("");
    e.gradient = {1.0 - 1.0 / x[0]};
    return e;
  };
  LbfgsState state = start(logarithm, {0.1});
  minimise(state, {{0.01}, {10.0}}, logarithm);
  EXPECT_NEAR(state.x[0], 1.0, 1e-4);
}

}  // namespace
}  // namespace opaline::reconstruct
