#include "reconstruct/parametrization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace opaline::reconstruct {
namespace {

using ::testing::DoubleNear;
using ::testing::Each;
using ::testing::ElementsAre;

const std::vector<Block> kBlocks{{1, 1, 1, 0.5, 0.4, 0.3},
                                 {1, 1, 7, 0.5, 0.5, 0.5},
                                 {6, 5, 4, 0.5, 0.5, 0.5},
                                 {7, 1, 3, 0.2, 1.0, 0.2},
                                 {9, 8, 5, 1.0, 1.0, 1.0}};

std::vector<Parametrization> every_kind(const Block& b) {
  const auto layers = FieldBasis::layered(b, Face::kZMin);
  return {Parametrization::full(b),
          {FieldBasis::homogeneous(b), FieldBasis::homogeneous(b)},
          {layers, layers},
          {FieldBasis::layered(b, Face::kXMax), FieldBasis::layered(b, Face::kYMin)},
          {FieldBasis::blocks(b, 2), FieldBasis::blocks(b, 4)},
          {FieldBasis::homogeneous(b), FieldBasis::blocks(b, 3)},
          {FieldBasis::full(b), FieldBasis::columns(b, Face::kZMin, 4)}};
}

std::vector<double> random_values(std::size_t count, std::mt19937& random) {
  std::vector<double> values(count);
  std::normal_distribution<double> normal;
  for (double& v : values) v = normal(random);
  return values;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// Tolerance: rounding of sums of at most 720 products.
TEST(Parametrization, GathersByTheTransposeOfWhatExpands) {
  std::mt19937 random(1);
  for (const Block& block : kBlocks) {
    for (const Parametrization& p : every_kind(block)) {
      const auto a = random_values(p.size(), random);
      const auto b = random_values(p.cell_value_count(), random);
      const double left = dot(p.expand(a), b);
      EXPECT_NEAR(left, dot(a, p.gather(b)), 1e-13 * std::sqrt(dot(a, a) * dot(b, b)));
    }
  }
}

TEST(Parametrization, HasAsManyParametersAsItsKindSays) {
  const Block b{9, 8, 5, 1.0, 1.0, 1.0};
  std::vector<std::size_t> sizes;
  for (const Parametrization& p : every_kind(b)) sizes.push_back(p.size());
  EXPECT_THAT(sizes,
              ElementsAre(720, 2, 10, 17, 5 * 4 * 3 + 3 * 2 * 2, 1 + 3 * 3 * 2, 360 + 3 * 2 * 5));
}

TEST(Parametrization, KeepsAConstantInEveryKind) {
  for (const Block& block : kBlocks) {
    for (const Parametrization& p : every_kind(block)) {
      const std::vector<double> constant(p.cell_value_count(), -1.25);
      EXPECT_THAT(p.average(constant), Each(DoubleNear(-1.25, 1e-14)));
      EXPECT_THAT(p.expand(p.average(constant)), Each(DoubleNear(-1.25, 1e-14)));
    }
  }
}

TEST(Parametrization, IsTheCellsThemselvesWhenFull) {
  std::mt19937 random(2);
  const auto full = Parametrization::full({6, 5, 4, 1.0, 1.0, 1.0});
  const auto values = random_values(full.size(), random);
  EXPECT_EQ(full.expand(values), values);
  EXPECT_EQ(full.gather(values), values);
  EXPECT_EQ(full.average(values), values);
}

TEST(Parametrization, VariesByLayerAlongTheAxisOfTheFaceOnly) {
  const Block b{2, 1, 3, 1.0, 1.0, 1.0};
  const auto z = FieldBasis::layered(b, Face::kZMax);
  std::vector<double> cells(b.cell_count());
  z.expand(std::vector<double>{1, 2, 3}, cells);
  EXPECT_THAT(cells, ElementsAre(1, 1, 2, 2, 3, 3));
  FieldBasis::layered(b, Face::kXMin).expand(std::vector<double>{1, 2}, cells);
  EXPECT_THAT(cells, ElementsAre(1, 2, 1, 2, 1, 2));
}

// Nodes of pairs of cells sit between them: a line is followed inside the outer nodes, and kept constant beyond.
TEST(Parametrization, FollowsALineBetweenItsNodes) {
  const Block b{8, 1, 1, 1.0, 1.0, 1.0};
  const auto pairs = FieldBasis::blocks(b, 2);
  std::vector<double> cells(8);
  pairs.expand(std::vector<double>{1.0, 3.0, 5.0, 7.0}, cells);
  EXPECT_THAT(cells, ElementsAre(1.0, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.0));
}

}  // namespace
}  // namespace opaline::reconstruct
