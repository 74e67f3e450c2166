#include "reconstruct/lbfgs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

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

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// -H g as textbooks write it, on the vectors themselves (Nocedal & Wright, alg. 7.4).
Vector two_loops(const LbfgsState& state) {
  Vector q = state.at.gradient;
  Vector alpha(state.pairs.size());
  for (std::size_t k = alpha.size(); k-- > 0;) {
    const auto& [s, y] = state.pairs[k];
    alpha[k] = dot(s, q) / dot(s, y);
    for (std::size_t i = 0; i < q.size(); ++i) q[i] -= alpha[k] * y[i];
  }
  const auto& [newest_s, newest_y] = state.pairs.back();
  for (double& v : q) v *= dot(newest_s, newest_y) / dot(newest_y, newest_y);
  for (std::size_t k = 0; k < alpha.size(); ++k) {
    const auto& [s, y] = state.pairs[k];
    const double beta = dot(y, q) / dot(s, y);
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += (alpha[k] - beta) * s[i];
  }
  for (double& v : q) v = -v;
  return q;
}

// sum_i i (x_i - 1 / i)^2 / 2 + (sum_i x_i)^2 / 2 in forty dimensions.
Result<Evaluation> bowl(std::span<const double> x, std::stop_token /*stop*/) {
  Evaluation e;
  const double sum = std::accumulate(x.begin(), x.end(), 0.0);
  e.value = 0.5 * sum * sum;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double weight = static_cast<double>(i + 1);
    const double miss = x[i] - 1.0 / weight;
    e.value += 0.5 * weight * miss * miss;
    e.gradient.push_back(weight * miss + sum);
  }
  return e;
}

// The products of float64 vectors are good to 1e-15; the recursion over twelve pairs loses a few digits more than the
// one on vectors. From the fifteenth step on the oldest pairs have been dropped.
TEST(Lbfgs, StepsAsTheTwoLoopRecursionOnTheVectorsDoes) {
  LbfgsState state = start(bowl, Vector(40, 0.0));
  const Bounds bounds{Vector(40, -10.0), Vector(40, 10.0)};
  int compared = 0;
  for (int step = 0; step < 25; ++step) {
    const LbfgsState before = state;
    ASSERT_TRUE(lbfgs_step(state, bounds, {}, bowl, {}));
    if (before.pairs.empty()) continue;
    const Vector d = two_loops(before);
    Vector moved = state.x;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] -= before.x[i];
    const double alpha = dot(moved, d) / dot(d, d);
    for (std::size_t i = 0; i < moved.size(); ++i)
      EXPECT_NEAR(moved[i], alpha * d[i], 1e-9 * std::sqrt(dot(moved, moved))) << step;
    ++compared;
    ASSERT_LE(state.pairs.size(), 12U);
  }
  EXPECT_GE(compared, 20);
}

// A checkpoint keeps the pairs and not their products.
TEST(Lbfgs, GoesOnTheSameWithoutTheProductsOfItsPairs) {
  LbfgsState whole = start(bowl, Vector(40, 0.0));
  const Bounds bounds{Vector(40, -10.0), Vector(40, 0.2)};
  for (int step = 0; step < 5; ++step) ASSERT_TRUE(lbfgs_step(whole, bounds, {}, bowl, {}));
  LbfgsState resumed = whole;
  resumed.products.clear();
  for (int step = 0; step < 5; ++step) {
    ASSERT_TRUE(lbfgs_step(whole, bounds, {}, bowl, {}));
    ASSERT_TRUE(lbfgs_step(resumed, bounds, {}, bowl, {}));
  }
  EXPECT_EQ(whole.x, resumed.x);
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
