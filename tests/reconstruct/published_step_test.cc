#include "reconstruct/published_step.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kCells = 3;
const std::vector<double> kKappa{0.2, 0.35, 0.1};        // of the minimum, mm
const std::vector<double> kAbsorption{0.01, 0.03, 0.2};  // 1/mm

// A bowl in the raw parameters, 1/2 sum ((kappa - kappa*) / kappa*)^2 + the same of sigma_a, with its derivatives by
// (log sigma_s', log sigma_a), worked out here: kappa = 1 / (3 (sigma_s' + sigma_a)).
Evaluation bowl(std::span<const double> x) {
  Evaluation at;
  at.gradient.assign(2 * kCells, 0.0);
  for (std::size_t i = 0; i < kCells; ++i) {
    const double scattering = std::exp(x[i]);
    const double absorption = std::exp(x[kCells + i]);
    const double kappa = 1.0 / (3.0 * (scattering + absorption));
    const double u = kappa / kKappa[i] - 1.0;
    const double v = absorption / kAbsorption[i] - 1.0;
    at.value += 0.5 * (u * u + v * v);
    const double by_sum = u / kKappa[i] * -3.0 * kappa * kappa;
    at.gradient[i] = by_sum * scattering;
    at.gradient[kCells + i] = by_sum * absorption + v / kAbsorption[i] * absorption;
  }
  return at;
}

PublishedObjective objective() {
  return {
      [](std::span<const double> x, std::stop_token) -> Result<Evaluation> { return bowl(x); },
      [](std::span<const double> x, std::stop_token) -> Result<double> { return bowl(x).value; }};
}

LbfgsState start() {
  LbfgsState state;
  state.x.assign(kCells, std::log(2.0));
  state.x.resize(2 * kCells, std::log(0.05));
  state.at = bowl(state.x);
  return state;
}

Bounds wide() {
  return {std::vector<double>(2 * kCells, std::log(1e-6)),
          std::vector<double>(2 * kCells, std::log(1e3))};
}

TEST(PublishedStep, FindsTheBottomOfABowlInTheRawParameters) {
  LbfgsState state = start();
  for (int n = 0; n < 200; ++n) {
    const auto outcome = published_step(state, wide(), objective(), {});
    ASSERT_TRUE(outcome);
    if (*outcome == StepOutcome::kNoDescent) break;
  }
  EXPECT_LE(state.at.value,
            1e-4);  // from 3 and more; the line search knows a length to a thousandth
  for (std::size_t i = 0; i < kCells; ++i) {
    EXPECT_NEAR(std::exp(state.x[kCells + i]), kAbsorption[i], 0.02 * kAbsorption[i]);
  }
}

TEST(PublishedStep, NeverRises) {
  LbfgsState state = start();
  for (int n = 0; n < 20; ++n) {
    const double before = state.at.value;
    ASSERT_TRUE(published_step(state, wide(), objective(), {}));
    EXPECT_LE(state.at.value, before);
  }
}

TEST(PublishedStep, StaysWithinTheBounds) {
  LbfgsState state = start();
  Bounds bounds = wide();
  bounds.lower.assign(kCells, std::log(1.5));  // kappa below 0.22
  bounds.lower.resize(2 * kCells, std::log(0.02));
  for (int n = 0; n < 20; ++n) {
    ASSERT_TRUE(published_step(state, bounds, objective(), {}));
    for (std::size_t i = 0; i < state.x.size(); ++i) EXPECT_GE(state.x[i], bounds.lower[i]);
  }
}

TEST(PublishedStep, LeavesTheStateAsItWasWhenTheObjectiveFails) {
  LbfgsState state = start();
  PublishedObjective failing = objective();
  failing.value = [](std::span<const double>, std::stop_token) -> Result<double> {
    return cancelled("solve");
  };
  const std::vector<double> before = state.x;
  const auto outcome = published_step(state, wide(), failing, {});
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(state.x, before);
}

}  // namespace
}  // namespace opaline::reconstruct
