#include "reconstruct/spherical_gradient/curvature_blocks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::reconstruct {
namespace {

constexpr int kSide = 64;

/// Answers of curvature 1 + slope x, known to 2 %.
ScatteringMaps plain(double slope) {
  ScatteringMaps maps;
  maps.width = kSide;
  maps.height = kSide;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      maps.curvature.push_back(static_cast<float>(1.0 + slope * x));
      maps.curvature_deviation.push_back(0.02F);
      maps.left_out.push_back(LeftOut::kFound);
    }
  return maps;
}

// One pixel in fifty keeps a window so small that its curvature is off by fifteen times what it is, and says so.
TEST(CurvatureBlocks, LetPixelsThatKnowLittleSayLittle) {
  ScatteringMaps maps = plain(0.0);
  for (std::size_t at = 0; at < maps.curvature.size(); at += 50) {
    maps.curvature[at] = at % 100 == 0 ? 16.0F : -14.0F;
    maps.curvature_deviation[at] = 5.0F;
    maps.left_out[at] = LeftOut::kTooFlat;
  }
  ThreadTeam team(2);

  const auto around = CurvatureBlocks(maps, 2, team).around(kSide / 2, kSide / 2, 16.0);

  EXPECT_NEAR(around.mean, 1.0, 1e-3);
  EXPECT_LT(around.variance, 0.01);  // 4.5 if all weighed the same
  EXPECT_NEAR(around.by_x, 0.0, 1e-3);
}

TEST(CurvatureBlocks, FollowWhatIsKnown) {
  const double slope = 0.01;
  ThreadTeam team(2);

  const auto around = CurvatureBlocks(plain(slope), 2, team).around(kSide / 2, kSide / 2, 16.0);

  EXPECT_NEAR(around.by_x, slope, 0.02 * slope);
  EXPECT_NEAR(around.by_y, 0.0, 1e-6);
  EXPECT_NEAR(around.variance, slope * slope * 34.0 * 34.0 / 12.0, 0.05 * slope * slope * 96.0);
}

}  // namespace
}  // namespace opaline::reconstruct
