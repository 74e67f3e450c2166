#include "reconstruct/coarse_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "tests/reconstruct/support/random_problem.h"

namespace opaline::reconstruct {
namespace {

std::vector<double> random_values(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.5, 2.0);
  std::vector<double> values(count);
  for (double& v : values) v = uniform(random);
  return values;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<double> ramp(const Block& b) {
  std::vector<double> u;
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i)
        u.push_back(1.0 + 0.3 * (i + 0.5) * b.hx - 0.2 * (j + 0.5) * b.hy + 0.1 * (k + 0.5) * b.hz);
  return u;
}

TEST(CoarseGrid, HalvesTheSameBlock) {
  const Block fine{130, 53, 37, 0.5, 0.5, 0.5};
  const auto coarse = coarser_block(fine);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->cells(), (std::array{65, 27, 19}));
  EXPECT_DOUBLE_EQ(coarse->size().y, fine.size().y);
  EXPECT_DOUBLE_EQ(coarse->size().z, fine.size().z);
}

TEST(CoarseGrid, LeavesLongCellsAlone) {
  const auto coarse = coarser_block({40, 40, 10, 0.25, 0.25, 1.0});
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->cells(), (std::array{20, 20, 10}));
}

TEST(CoarseGrid, DoesNotExistOfAThinBlock) {
  EXPECT_FALSE(coarser_block({64, 64, 6, 0.5, 0.5, 0.5}));
  EXPECT_FALSE(coarser_block({1, 1, 1, 0.5, 0.5, 0.5}));
}

TEST(CoarseGrid, KeepsMeansWhereItRestricts) {
  const Block fine{9, 7, 11, 0.5, 0.6, 0.4};
  const Block coarse = *coarser_block(fine);
  const std::vector<double> values = random_values(fine.cell_count(), 1);
  EXPECT_NEAR(mean(restricted(fine, coarse, values)), mean(values), 1e-12);
}

TEST(CoarseGrid, ReproducesARampBetweenTheOutermostCentres) {
  const Block fine{12, 9, 8, 0.5, 0.6, 0.4};
  const Block coarse = *coarser_block(fine);
  const std::vector<double> wanted = ramp(fine);
  const std::vector<double> got = prolonged(coarse, fine, ramp(coarse));
  for (int k = 1; k < fine.nz - 1; ++k)
    for (int j = 1; j < fine.ny - 1; ++j)
      for (int i = 1; i < fine.nx - 1; ++i)
        EXPECT_NEAR(got[fine.index(i, j, k)], wanted[fine.index(i, j, k)], 1e-12);
}

// A misfit of one everywhere: chi^2 is the sum of the weights, on both grids. Light likewise.
TEST(CoarseGrid, KeepsTheSizeOfChiSquaredAndTheLight) {
  ChannelProblem fine = testing_problem::random_problem({"",
                                                         testing_problem::kCollimated,
                                                         testing_problem::kCentroid,
                                                         Face::kZMin,
                                                         Face::kYMax,
                                                         0.0});
  fine.data_count = 40;
  fine.noise = 10.0;
  const Block coarse{3, 3, 2, 1.0, 1.0, 0.8};
  const ChannelProblem made = coarsened(fine, coarse);
  const auto sum = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0);
  };
  for (std::size_t m = 0; m < fine.illuminations.size(); ++m) {
    EXPECT_NEAR(sum(made.illuminations[m].weight), sum(fine.illuminations[m].weight), 1e-9);
    EXPECT_NEAR(
        mean(made.illuminations[m].irradiance), mean(fine.illuminations[m].irradiance), 1e-12);
  }
  EXPECT_NEAR(made.noise / static_cast<double>(made.data_count), 0.25, 1e-12);
}

TEST(CoarseGrid, LeavesOutWhatIsMasked) {
  ChannelProblem fine = testing_problem::random_problem({"",
                                                         testing_problem::kCollimated,
                                                         testing_problem::kCentroid,
                                                         Face::kZMin,
                                                         Face::kZMax,
                                                         0.0});
  ChannelIllumination& first = fine.illuminations[0];
  std::fill(first.weight.begin(), first.weight.end(), 1.0);
  std::fill(first.radiance.begin(), first.radiance.end(), 0.02);
  first.radiance[0] = 1e6;
  first.weight[0] = 0.0;
  const ChannelProblem made = coarsened(fine, {3, 3, 2, 1.0, 1.0, 0.8});
  for (const double l : made.illuminations[0].radiance) EXPECT_NEAR(l, 0.02, 1e-12);
}

}  // namespace
}  // namespace opaline::reconstruct
