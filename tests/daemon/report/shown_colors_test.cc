#include "daemon/report/shown_colors.h"

#include <gtest/gtest.h>

namespace opaline::daemon {
namespace {

/// A camera whose channels are sRGB's once its white is grey; the matrix is Lindbloom's of sRGB under D50, the other way round.
calibration::ColorCorrection srgb_camera() {
  return {calibration::ColorModel::kMatrix,
          {2.0, 1.0, 4.0},
          {0.4360747,
           0.3850649,
           0.1430804,
           0.2225045,
           0.7168786,
           0.0606169,
           0.0139322,
           0.0971045,
           0.7141733}};
}

/// Of one pixel, by a camera that answers to a unit of radiance by these codes.
Image<float> seen(const std::array<double, 3>& srgb, const std::array<double, 3>& sensitivity) {
  Image<float> radiance(1, 1, 3);
  const auto balance = srgb_camera().white_balance;
  for (std::size_t c = 0; c < 3; ++c)
    radiance.samples()[c] = static_cast<float>(srgb[c] / balance[c] / sensitivity[c]);
  return radiance;
}

// 1e-5: the matrices' published digits.
TEST(ShownColors, AreThoseThatTheChartToldWhateverTheChannelsSensitivities) {
  const std::array<double, 3> sensitivity{1e9, 2e9, 0.5e9};
  const ShownColors colors(srgb_camera(), sensitivity, "3 x 3 matrix");
  for (const std::array<double, 3> srgb :
       {std::array{1.0, 0.0, 0.0}, {0.0, 0.5, 0.0}, {0.2, 0.3, 0.9}, {0.7, 0.7, 0.7}}) {
    const Image<float> shown = colors.apply(seen(srgb, sensitivity));
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(shown.samples()[c] * sensitivity[1], srgb[c], 1e-5) << srgb[0] << ", " << c;
  }
}

TEST(ShownColors, KeepTheGreenOfTheLampsWhite) {
  const std::array<double, 3> sensitivity{3e9, 1e9, 2e9};
  const ShownColors colors(srgb_camera(), sensitivity, "3 x 3 matrix");
  const Image<float> white = seen({1.0, 1.0, 1.0}, sensitivity);
  const Image<float> shown = colors.apply(white);
  for (const float v : shown.samples()) EXPECT_NEAR(v / white.samples()[1], 1.0, 1e-5);
}

TEST(ShownColors, CutOffWhatNoDisplayShows) {
  calibration::ColorCorrection deep = srgb_camera();
  deep.coefficients = {
      1, 0, 0, 0, 1, 0, 0, 0, 1};  // channels are X, Y and Z: pure ones are outside of sRGB
  const ShownColors colors(deep, {1.0, 1.0, 1.0}, "3 x 3 matrix");
  const Image<float> shown = colors.apply(seen({0.0, 1.0, 0.0}, {1.0, 1.0, 1.0}));
  for (const float v : shown.samples()) EXPECT_GE(v, 0.0F);
  EXPECT_GT(shown.samples()[1], 1.0F);
}

}  // namespace
}  // namespace opaline::daemon
