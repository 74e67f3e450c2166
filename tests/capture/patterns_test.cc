#include "capture/patterns.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <set>
#include <string>

namespace opaline::capture {
namespace {

using ::testing::HasSubstr;

ProjectorCalibration flat_projector() {
  ProjectorCalibration p;
  p.black_level = 0.0;
  p.peak_irradiance = {1e-3, 2e-3, 3e-3};
  return p;
}

const Block kDemo{48, 48, 12, 0.5, 0.5, 0.5};

double power(const Image<float>& irradiance, int channel) {
  double sum = 0.0;
  for (int y = 0; y < irradiance.height(); ++y) {
    for (int x = 0; x < irradiance.width(); ++x) sum += irradiance.at(x, y, channel);
  }
  return sum;
}

TEST(Patterns, CoverTheFaceOnceWithTheRegions) {
  const auto set = make_patterns({4, 8}, kDemo, Face::kZMin, flat_projector());
  ASSERT_TRUE(set) << set.error().message;
  Image<float> sum(48, 48, 3);
  int regions = 0;
  for (const Light& light : set->lights) {
    if (light.held_out) continue;
    ++regions;
    for (std::size_t i = 0; i < sum.samples().size(); ++i) {
      sum.samples()[i] += light.irradiance.samples()[i];
    }
  }
  EXPECT_EQ(regions, 16);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 48; ++x) EXPECT_FLOAT_EQ(sum.at(x, y, 1), 2e-3F);
  }
}

TEST(Patterns, HoldOutShiftedLargerAndSmallerLightsThatAreNoRegions) {
  for (const int n : {2, 3, 4, 5}) {
    const auto set = make_patterns({n, 8}, kDemo, Face::kZMin, flat_projector());
    ASSERT_TRUE(set) << set.error().message;
    std::set<std::string> names;
    std::set<std::uint64_t> ids{kBlackPattern, kWhitePattern};
    int held_out = 0;
    const double region = power(set->lights[0].irradiance, 0);
    for (const Light& light : set->lights) {
      EXPECT_TRUE(names.insert(light.name).second) << light.name;
      EXPECT_TRUE(ids.insert(light.pattern.id).second);
      if (!light.held_out) continue;
      ++held_out;
      for (const Light& other : set->lights) {
        if (other.name != light.name) {
          EXPECT_NE(other.pattern.codes, light.pattern.codes) << light.name << " is " << other.name;
        }
      }
      const double times = power(light.irradiance, 0) / region;
      const double expected = light.name.find("large") != std::string::npos   ? 4.0
                              : light.name.find("small") != std::string::npos ? 0.25
                                                                              : 1.0;
      EXPECT_NEAR(times, expected, 0.05 * expected) << light.name;  // whole pixels
    }
    EXPECT_GE(held_out, 6) << n;
  }
}

// A region edge in the middle of a cell: the cell gets its share by area.
TEST(Patterns, GiveCellsAtTheEdgeTheirFraction) {
  const Block block{3, 1, 1, 1.0, 1.0, 1.0};
  ProjectorCalibration p = flat_projector();
  p.width = 60;
  p.height = 20;
  p.mm_per_pixel = 0.05;
  p.offset_x_px = 0.0;
  Image<std::uint8_t> codes(60, 20, 3, 0);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 35; ++x) codes.at(x, y, 0) = 255;
  }
  const Image<float> e = irradiance_of(codes, block, Face::kZMin, p);
  EXPECT_FLOAT_EQ(e.at(0, 0, 0), 0.5e-3F);
  EXPECT_FLOAT_EQ(e.at(1, 0, 0), 0.5F * 0.75e-3F);
  EXPECT_FLOAT_EQ(e.at(2, 0, 0), 0.0F);
  EXPECT_FLOAT_EQ(e.at(0, 0, 1), 0.0F);
}

TEST(Patterns, UndoGammaBlackLevelAndVignetting) {
  const Block block{2, 2, 1, 4.0, 4.0, 1.0};
  ProjectorCalibration p = flat_projector();
  p.width = p.height = 160;
  p.mm_per_pixel = 0.05;
  p.offset_x_px = 0.0;
  p.black_level = 0.1;
  p.vignetting = {{-0.3, 0.0, 0.0}};
  const Image<float> e =
      irradiance_of(Image<std::uint8_t>(160, 160, 3, 128), block, Face::kZMin, p);
  // The mean of r^2 over a quarter of the square picture: 2/3 of the half side squared, over the
  // half diagonal squared: 1/3. Pixel centres instead of the integral: 1e-5 of it.
  const double expected = 1e-3 * 0.9 * std::pow(128.0 / 255.0, 2.2) * (1.0 - 0.3 / 3.0);
  EXPECT_NEAR(e.at(1, 0, 0), expected, 1e-4 * expected);
}

TEST(Patterns, RefuseAFaceTheProjectorDoesNotReach) {
  ProjectorCalibration p = flat_projector();
  p.offset_x_px = 200.0;
  const auto set = make_patterns({4, 8}, kDemo, Face::kZMin, p);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(set.error().message, HasSubstr("x 560 to 680"));
}

TEST(Patterns, RefuseRegionsSmallerThanAPixel) {
  ProjectorCalibration p = flat_projector();
  p.mm_per_pixel = 2.0;
  p.offset_x_px = 0.0;
  EXPECT_FALSE(make_patterns({32, 0}, kDemo, Face::kZMin, p));
}

}  // namespace
}  // namespace opaline::capture
