#include "reconstruct/diffusion/level_builder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::reconstruct::diffusion {
namespace {

/// Coefficients that jump from cell to cell, without a library's random numbers.
Medium rough_medium(int nx, int ny, int nz) {
  Medium medium{{nx, ny, nz, 0.5, 0.6, 0.7}, {}, {}, 1.3};
  for (std::size_t c = 0; c < medium.block.cell_count(); ++c) {
    const double wave = std::sin(12.9898 * static_cast<double>(c + 1)) * 43758.5453;
    const double part = wave - std::floor(wave);
    medium.diffusion.push_back(0.1 * std::pow(100.0, part));
    medium.absorption.push_back(0.01 * part);
  }
  return medium;
}

std::vector<Level> built(const Medium& medium, int threads) {
  ThreadTeam team(threads);
  std::vector<Level> levels;
  LevelBuilder().build(medium, team, levels);
  return levels;
}

void expect_same(const std::vector<Level>& a, const std::vector<Level>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t l = 0; l < a.size(); ++l) {
    EXPECT_EQ(a[l].cells, b[l].cells);
    EXPECT_EQ(a[l].ratio, b[l].ratio);
    EXPECT_EQ(a[l].diagonal, b[l].diagonal) << "level " << l;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(a[l].conductance[axis], b[l].conductance[axis]) << "level " << l;
      EXPECT_EQ(a[l].transfer[axis], b[l].transfer[axis]) << "level " << l;
    }
  }
}

TEST(LevelBuilder, MakesTheSameNumbersHoweverManyThreadsShareThem) {
  const Medium medium = rough_medium(31, 20, 17);
  expect_same(built(medium, 1), built(medium, 3));
}

TEST(LevelBuilder, ForgetsTheGridThatItBuiltBefore) {
  ThreadTeam team(2);
  LevelBuilder builder;
  std::vector<Level> levels;
  for (const auto& [nx, ny, nz] : {std::array{9, 20, 40}, {40, 20, 9}, {1, 1, 1}, {31, 20, 17}}) {
    const Medium medium = rough_medium(nx, ny, nz);
    builder.build(medium, team, levels);
    expect_same(levels, built(medium, 1));
  }
}

TEST(LevelBuilder, PutsTheMatrixOfTheDiffusionEquationOnTheFinestLevel) {
  const Medium medium = rough_medium(3, 2, 1);
  const Level finest = built(medium, 1).front();
  const std::vector<double>& k = medium.diffusion;
  const double across_x = 0.6 * 0.7 / 0.5;  // face / spacing, mm
  const double across_y = 0.5 * 0.7 / 0.6;
  EXPECT_DOUBLE_EQ(finest.conductance[0][0], across_x * 2.0 * k[0] * k[1] / (k[0] + k[1]));
  EXPECT_DOUBLE_EQ(finest.conductance[1][1], across_y * 2.0 * k[1] * k[4] / (k[1] + k[4]));
  EXPECT_EQ(finest.conductance[0][2], 0.0);
  EXPECT_EQ(finest.conductance[2][1], 0.0);
  const auto wall = [&](double area, double h) { return area / (2.0 * 1.3 + h / (2.0 * k[1])); };
  const double sum = finest.conductance[0][0] + finest.conductance[0][1] +
                     finest.conductance[1][1] + wall(0.5 * 0.7, 0.6) + 2.0 * wall(0.3, 0.7) +
                     0.5 * 0.6 * 0.7 * medium.absorption[1];
  EXPECT_NEAR(finest.diagonal[1], sum, 1e-14 * sum);
}

TEST(LevelBuilder, WeighsAnAggregateBesideByTheResistancesOnTheWay) {
  const Medium medium = rough_medium(5, 4, 4);
  const Level finest = built(medium, 1).front();
  ASSERT_EQ(finest.ratio, (std::array{2, 2, 2}));
  const auto resistance = [&](std::size_t c) { return 1.0 / finest.conductance[0][c]; };
  const double between = 0.5 * resistance(0) + resistance(1) + 0.5 * resistance(2);
  EXPECT_NEAR(finest.transfer[0][1], 0.5 * resistance(0) / between, 1e-14);
  EXPECT_NEAR(finest.transfer[0][2], 0.5 * resistance(2) / between, 1e-14);
  const double alone = 0.5 * resistance(2) + resistance(3);  // cell 4 is its aggregate's only one
  EXPECT_NEAR(finest.transfer[0][3], 0.5 * resistance(2) / alone, 1e-14);
  EXPECT_EQ(finest.transfer[0][4], 0.0);
}

}  // namespace
}  // namespace opaline::reconstruct::diffusion
