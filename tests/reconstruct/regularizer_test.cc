#include "reconstruct/regularizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

namespace opaline::reconstruct {
namespace {

constexpr double kLambda = 300.0;

// An 8 x 6 x 4 mm block of cubes.
Block block_of(double cell) {
  const auto count = [cell](double size) { return static_cast<int>(std::lround(size / cell)); };
  return {count(8.0), count(6.0), count(4.0), cell, cell, cell};
}

// Of the position of the cells' centres, mm.
std::vector<double> field(const Block& b, const std::function<double(double, double, double)>& f) {
  std::vector<double> u;
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i)
        u.push_back(f((i + 0.5) * b.hx, (j + 0.5) * b.hy, (k + 0.5) * b.hz));
  return u;
}

std::vector<double> random_field(const Block& b, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  return field(b, [&](double, double, double) { return normal(random); });
}

double value(const Regularizer& r, const std::vector<double>& u) {
  std::vector<double> unused(u.size(), 0.0);
  return r.add(u, unused);
}

double smooth(double x, double y, double z) {
  return 0.5 * std::sin(std::numbers::pi * x / 8.0) * std::cos(std::numbers::pi * y / 6.0) +
         0.1 * std::cos(std::numbers::pi * z / 4.0);
}

// int |grad u|^2 dV of sin cos + cos over the block, by hand: 0.25 pi^2 (1/64 + 1/36) 192 / 4 +
// 0.01 pi^2 / 16 192 / 2; the two parts are orthogonal.
TEST(Regularizer, TendsToItsIntegralOnEveryGrid) {
  const double pi2 = std::numbers::pi * std::numbers::pi;
  const double integral = 0.25 * pi2 * (1.0 / 64.0 + 1.0 / 36.0) * 48.0 + 0.01 * pi2 / 16.0 * 96.0;
  const double exact = kLambda / (2.0 * 4.0) * integral;
  for (const double cell : {1.0, 0.5, 0.25, 0.125}) {
    const Block b = block_of(cell);
    // Midpoint differences err by (pi h / l)^2 / 12, and the faces at the surface are missing: less than h / l.
    EXPECT_NEAR(value(Regularizer(b, kLambda), field(b, smooth)) / exact, 1.0, 0.25 * cell) << cell;
  }
}

TEST(Regularizer, CostsAnEdgeWhatItsHeightDoesHoweverSharp) {
  const auto step = [](double x, double, double) { return x < 4.0 ? 0.0 : 2.0; };
  std::vector<double> edges;
  std::vector<double> squares;
  for (const double cell : {0.5, 0.25, 0.125}) {
    const Block b = block_of(cell);
    edges.push_back(value(Regularizer(b, kLambda, Smoothness::kTotalVariation), field(b, step)));
    squares.push_back(value(Regularizer(b, kLambda), field(b, step)));
  }
  EXPECT_NEAR(squares[1] / squares[0], 2.0, 1e-9);
  EXPECT_NEAR(squares[2] / squares[1], 2.0, 1e-9);
  // lambda e / l times height times area, each of the two cells at the edge seeing half the square: sqrt(2) of it.
  const double edge = Regularizer::kEdge / 4.0;
  const double limit = kLambda * edge / 4.0 * 2.0 * 24.0 * std::numbers::sqrt2;
  EXPECT_NEAR(edges[2] / limit, 1.0, 0.05);  // 2 h e / (sqrt(2) height): the smoothing's share
  EXPECT_LT(edges[2] / edges[0], 1.15);
}

TEST(Regularizer, IsTheSameOfBothKindsWhereNothingHasAnEdge) {
  const Block b = block_of(0.5);
  std::vector<double> u = field(b, smooth);
  for (double& v : u) v *= 1e-3;
  EXPECT_NEAR(value(Regularizer(b, kLambda, Smoothness::kTotalVariation), u) /
                  value(Regularizer(b, kLambda), u),
              1.0,
              1e-4);
}

TEST(Regularizer, DoesNotDependOnTheUnitOfLength) {
  const Block mm = block_of(0.5);
  const Block metres{mm.nx, mm.ny, mm.nz, 5e-4, 5e-4, 5e-4};
  const std::vector<double> u = random_field(mm, 1);
  for (const Smoothness kind : {Smoothness::kH1, Smoothness::kTotalVariation})
    EXPECT_NEAR(
        value(Regularizer(mm, kLambda, kind), u) / value(Regularizer(metres, kLambda, kind), u),
        1.0,
        1e-12);
}

// Central differences of the gradient along a direction; for the total variation the product leaves a part out and is
// the larger of the two along every direction, since its weights fall with the gradient.
TEST(Regularizer, MultipliesByItsSecondDerivative) {
  const Block b = block_of(1.0);
  const std::vector<double> u = random_field(b, 1);
  const std::vector<double> v = random_field(b, 2);
  constexpr double kStep = 1e-4;
  for (const Smoothness kind : {Smoothness::kH1, Smoothness::kTotalVariation}) {
    const Regularizer r(b, kLambda, kind);
    const auto gradient_at = [&](double t) {
      std::vector<double> moved = u;
      for (std::size_t i = 0; i < u.size(); ++i) moved[i] += t * v[i];
      std::vector<double> g(u.size(), 0.0);
      r.add(moved, g);
      return g;
    };
    const std::vector<double> above = gradient_at(kStep);
    const std::vector<double> below = gradient_at(-kStep);
    std::vector<double> product(u.size(), 0.0);
    r.add_product(u, v, product);
    double by_differences = 0.0;
    for (std::size_t i = 0; i < u.size(); ++i)
      by_differences += v[i] * (above[i] - below[i]) / (2.0 * kStep);
    const double by_product = std::inner_product(v.begin(), v.end(), product.begin(), 0.0);
    if (kind == Smoothness::kH1) {
      EXPECT_NEAR(by_product / by_differences, 1.0, 1e-7);
    } else {
      EXPECT_GT(by_product, by_differences);
      EXPECT_GT(by_differences, 0.0);
    }
  }
}

TEST(Regularizer, HasTheDiagonalOfItsProduct) {
  const Block b = block_of(2.0);
  const std::vector<double> u = random_field(b, 3);
  for (const Smoothness kind : {Smoothness::kH1, Smoothness::kTotalVariation}) {
    const Regularizer r(b, kLambda, kind);
    std::vector<double> diagonal(u.size(), 0.0);
    r.add_diagonal(u, diagonal);
    for (std::size_t i = 0; i < u.size(); ++i) {
      std::vector<double> unit(u.size(), 0.0);
      std::vector<double> column(u.size(), 0.0);
      unit[i] = 1.0;
      r.add_product(u, unit, column);
      EXPECT_NEAR(column[i], diagonal[i], 1e-9 * diagonal[i]);
    }
  }
}

}  // namespace
}  // namespace opaline::reconstruct
