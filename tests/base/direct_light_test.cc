#include "base/direct_light.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline {
namespace {

constexpr Block kBlock{12, 10, 4, 0.5, 1.0, 0.5};

Image<float> lit_rectangle(int left, int top, int right, int bottom) {
  Image<float> irradiance(kBlock.nx, kBlock.ny, 3);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) irradiance.at(x, y, 1) = 0.5F;
  }
  return irradiance;
}

Image<std::uint8_t> masked(const Image<float>& irradiance, double margin_mm) {
  Image<std::uint8_t> mask(kBlock.nx, kBlock.ny, 1, 1);
  mask_direct_light(kBlock, Face::kZMax, irradiance, margin_mm, mask);
  return mask;
}

TEST(DirectLight, MasksEveryCellWhoseMiddleIsWithinTheMarginOfALitOne) {
  for (const double margin : {0.0, 0.4, 1.2, 2.1, 7.0, 1e6}) {
    const auto mask = masked(lit_rectangle(4, 3, 8, 6), margin);
    for (int y = 0; y < kBlock.ny; ++y) {
      for (int x = 0; x < kBlock.nx; ++x) {
        const double px = (x + 0.5) * kBlock.hx;  // of the cell's middle to the rectangle, in mm
        const double py = (y + 0.5) * kBlock.hy;
        const double dx = std::max({0.0, 4 * kBlock.hx - px, px - 8 * kBlock.hx});
        const double dy = std::max({0.0, 3 * kBlock.hy - py, py - 6 * kBlock.hy});
        EXPECT_EQ(mask.at(x, y), std::hypot(dx, dy) > margin ? 1 : 0)
            << x << ", " << y << ", margin " << margin;
      }
    }
  }
}

TEST(DirectLight, LeavesAFaceWithoutLightAlone) {
  const auto mask = masked(lit_rectangle(0, 0, 0, 0), 3.0);
  for (const std::uint8_t m : mask.samples()) EXPECT_EQ(m, 1);
}

TEST(DirectLight, KeepsWhatWasMaskedBefore) {
  Image<std::uint8_t> mask(kBlock.nx, kBlock.ny, 1, 1);
  mask.at(11, 9) = 0;
  mask_direct_light(kBlock, Face::kZMax, lit_rectangle(0, 0, 2, 2), 1.0, mask);
  EXPECT_EQ(mask.at(11, 9), 0);
  EXPECT_EQ(mask.at(11, 8), 1);
}

}  // namespace
}  // namespace opaline
