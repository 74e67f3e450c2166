#include "reconstruct/tangent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "reconstruct/objective.h"
#include "tests/reconstruct/support/random_problem.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

using namespace testing_problem;  // NOLINT(google-build-using-namespace)

std::vector<double> random_vector(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> v(size);
  for (double& x : v) x = normal(random);
  return v;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double norm(const std::vector<double>& a) { return std::sqrt(dot(a, a)); }

std::vector<double> difference(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

class TangentOf : public testing::TestWithParam<Case> {
 protected:
  Tangent tangent() { return *Tangent::at(problem_, solver_, coefficients_, 1e-12, {}); }

  // sqrt(w) L at p + step v.
  std::vector<double> whitened(const std::vector<double>& v, double step) {
    std::vector<double> p = to_parameters(coefficients_);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] += step * v[i];
    testing_support::DirectSolver solver;
    Objective objective(problem_, solver, {});
    const auto pictures = *objective.predict(to_coefficients(p), {});
    std::vector<double> out;
    for (std::size_t m = 0; m < pictures.size(); ++m)
      for (std::size_t x = 0; x < pictures[m].size(); ++x)
        out.push_back(std::sqrt(problem_.illuminations[m].weight[x]) * pictures[m][x]);
    return out;
  }

  ChannelProblem problem_ = random_problem(GetParam());
  ChannelCoefficients coefficients_ = random_medium(problem_.block.cell_count(), 3);
  testing_support::DirectSolver solver_;
};

// Richardson, error O(h^4) = 1e-12 at h = 1e-3; rounding 1e-16 / h.
TEST_P(TangentOf, MatchesDifferencesOfThePredictionInRandomDirections) {
  Tangent tangent = this->tangent();
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto v = random_vector(tangent.parameter_count(), seed);
    const double h = 1e-3;
    const auto outer = difference(whitened(v, 2 * h), whitened(v, -2 * h));
    std::vector<double> expected = difference(whitened(v, h), whitened(v, -h));
    for (std::size_t i = 0; i < expected.size(); ++i)
      expected[i] = (8.0 * expected[i] - outer[i]) / (12.0 * h);
    const auto found = *tangent.apply(v, {});
    EXPECT_LT(norm(difference(found, expected)), 1e-6 * norm(expected));
  }
}

// Cell by cell, so that no term hides behind larger ones: each cell's own picture to 1e-6 of itself.
TEST_P(TangentOf, MatchesDifferencesInEveryParameter) {
  Tangent tangent = this->tangent();
  for (std::size_t i = 0; i < tangent.parameter_count(); i += 7) {
    std::vector<double> v(tangent.parameter_count(), 0.0);
    v[i] = 1.0;
    const double h = 4e-3;
    const auto outer = difference(whitened(v, 2 * h), whitened(v, -2 * h));
    std::vector<double> expected = difference(whitened(v, h), whitened(v, -h));
    for (std::size_t k = 0; k < expected.size(); ++k)
      expected[k] = (8.0 * expected[k] - outer[k]) / (12.0 * h);
    const auto found = *tangent.apply(v, {});
    EXPECT_LT(norm(difference(found, expected)), 1e-6 * norm(expected)) << "parameter " << i;
  }
}

TEST_P(TangentOf, HasTheAdjointAsItsTranspose) {
  Tangent tangent = this->tangent();
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto v = random_vector(tangent.parameter_count(), seed);
    const auto y = random_vector(tangent.data_count(), seed + 10);
    const auto jv = *tangent.apply(v, {});
    const auto jty = *tangent.apply_adjoint(y, {});
    EXPECT_NEAR(dot(jv, y), dot(v, jty), 1e-10 * norm(jv) * norm(y));
  }
}

TEST_P(TangentOf, GivesTheGradientOfTheDataTerm) {
  Tangent tangent = this->tangent();
  Objective objective(problem_, solver_, {.tolerance = 1e-12});
  const auto expected = objective.evaluate(to_parameters(coefficients_), {})->gradient;
  const auto found = *tangent.apply_adjoint(tangent.residual(), {});
  EXPECT_LT(norm(difference(found, expected)), 1e-10 * norm(expected));
}

TEST_P(TangentOf, TakesOneSolveAnIlluminationAndProduct) {
  Tangent tangent = this->tangent();
  const long before = tangent.solves();
  ASSERT_TRUE(tangent.apply(random_vector(tangent.parameter_count(), 1), {}));
  ASSERT_TRUE(tangent.apply_adjoint(random_vector(tangent.data_count(), 1), {}));
  EXPECT_EQ(tangent.solves() - before, 2 * static_cast<long>(problem_.illuminations.size()));
}

INSTANTIATE_TEST_SUITE_P(Light, TangentOf, kEveryLight, case_name);
INSTANTIATE_TEST_SUITE_P(Rays, TangentOf, kEveryLightAlongRays, case_name);

// e^(-t) and everything behind it underflows at an optical depth of 2000 a cell.
TEST(Tangent, StaysFiniteBehindOpaqueCells) {
  const Case light{"", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 0.0};
  const ChannelProblem problem = random_problem(light);
  ChannelCoefficients opaque = random_medium(problem.block.cell_count(), 3);
  for (double& s : opaque.reduced_scattering) s = 5000.0;
  testing_support::DirectSolver solver;
  auto tangent = Tangent::at(problem, solver, opaque, 1e-12, {});
  ASSERT_TRUE(tangent);
  const auto moved = tangent->apply(random_vector(tangent->parameter_count(), 1), {});
  ASSERT_TRUE(moved);
  for (const double x : *moved) ASSERT_TRUE(std::isfinite(x));
}

}  // namespace
}  // namespace opaline::reconstruct
