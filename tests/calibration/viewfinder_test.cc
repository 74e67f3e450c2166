#include "calibration/viewfinder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "sim/sensor.h"
#include "sim/station_light.h"

namespace opaline::calibration {
namespace {

constexpr double kBlack = 64.0;
constexpr double kClipping = 4095.0;

/// Squares of 8 px, as a camera of that blur sees them.
Image<std::uint16_t> squares(double blur_px, double seconds) {
  Image<float> light(96, 64, 3);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      for (int c = 0; c < 3; ++c) light.at(x, y, c) = (x / 8 + y / 8) % 2 == 0 ? 1.6e-4F : 0.4e-4F;
    }
  }
  light = sim::blurred(light, blur_px);
  for (float& sample : light.samples()) sample *= static_cast<float>(seconds);
  sim::CameraOptics camera;
  camera.model.width = 96;
  camera.model.height = 64;
  camera.hot_pixel_fraction = 0.0;
  return sim::Sensor(camera, 1).read(light, seconds, 7);
}

TEST(Viewfinder, FocusFallsWithBlurAndNotWithLight) {
  double before = 1e9;
  for (const double blur : {0.3, 1.0, 2.0, 4.0}) {
    const auto figures = view_figures(squares(blur, 0.05), kBlack, kClipping);
    ASSERT_TRUE(figures);
    EXPECT_LT(figures->focus, 0.9 * before) << blur;
    before = figures->focus;
  }
  const auto bright = view_figures(squares(1.0, 0.06), kBlack, kClipping, 0.0);
  const auto dim = view_figures(squares(1.0, 0.03), kBlack, kClipping, 0.0);
  EXPECT_NEAR(bright->focus / dim->focus, 1.0, 0.02);
}

TEST(Viewfinder, CountsWhatIsSaturatedLitAndWhere) {
  Image<std::uint16_t> picture(10, 10, 3, 64);
  for (int x = 0; x < 10; ++x) {
    picture.at(x, 0, 0) = 4095;
    picture.at(x, 1, 1) = 2080;
  }
  const auto figures = view_figures(picture, kBlack, kClipping);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->saturated[0], 0.1, 1e-12);
  EXPECT_EQ(figures->saturated[1], 0.0);
  EXPECT_NEAR(figures->lit, 0.2, 1e-12);
  EXPECT_NEAR(figures->histogram[1][32], 0.1, 1e-12);
  for (const auto& channel : figures->histogram)
    EXPECT_NEAR(std::accumulate(channel.begin(), channel.end(), 0.0), 1.0, 1e-9);
  const auto view = view_picture(picture, kBlack, kClipping, *figures);
  EXPECT_EQ(view.at(3, 0, 0), 255);  // magenta
  EXPECT_EQ(view.at(3, 0, 1), 0);
  EXPECT_EQ(view.at(3, 0, 2), 255);
  EXPECT_EQ(view.height(), 74);
}

TEST(Viewfinder, RefusesWhatIsNoPicture) {
  EXPECT_FALSE(view_figures(Image<std::uint16_t>(4, 4, 1), kBlack, kClipping));
  EXPECT_FALSE(view_figures(Image<std::uint16_t>(4, 4, 3), kClipping, kBlack));
  EXPECT_FALSE(view_figures(Image<std::uint16_t>(), kBlack, kClipping));
}

}  // namespace
}  // namespace opaline::calibration
