// Corners painted by counting samples on either side of two edges, which shares no line with the error functions that are fitted.

#include "calibration/corner_model.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace opaline::calibration {
namespace {

constexpr int kSide = 41;
constexpr int kAcross = 4;  // samples of a pixel, each way
constexpr double kBlur = 0.9;
constexpr double kWithin = 0.01;  // px: a tenth of what may be left of a camera's reprojection
// Quantiles of the normal distribution in the middles of ten equal shares.
constexpr std::array kNormal{
    -1.6449, -1.0364, -0.6745, -0.3853, -0.1257, 0.1257, 0.3853, 0.6745, 1.0364, 1.6449};
constexpr double kNormalDeviation = 0.9336;  // of these ten

struct Painted {
  CameraModel::Pixel corner;
  double first = 0.1;
  double second = 1.5;
  std::function<double(double)> curve = [](double light) { return light; };
};

// The side of each edge that a place lies on.
class Sides {
 public:
  explicit Sides(const Painted& painted)
      : corner_(painted.corner),
        first_{-std::sin(painted.first), std::cos(painted.first)},
        second_{-std::sin(painted.second), std::cos(painted.second)} {}
  double light_at(double x, double y) const {
    const double u = x - corner_.x;
    const double v = y - corner_.y;
    const double alike = (first_[0] * u + first_[1] * v) * (second_[0] * u + second_[1] * v);
    return (alike > 0.0 ? 0.95 : 0.05) * (0.9 + 0.004 * x);  // the light falls off to one side
  }

 private:
  CameraModel::Pixel corner_;
  std::array<double, 2> first_;
  std::array<double, 2> second_;
};

double pixel_light(const Sides& sides, int x, int y) {
  double sum = 0.0;
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      for (const double a : kNormal) {
        for (const double b : kNormal)
          sum += sides.light_at(x + (i + 0.5) / kAcross + a * kBlur / kNormalDeviation,
                                y + (j + 0.5) / kAcross + b * kBlur / kNormalDeviation);
      }
    }
  }
  return sum / (kAcross * kAcross * 100.0);
}

Image<std::uint8_t> paint(const Painted& painted, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const Sides sides(painted);
  Image<std::uint8_t> grey(kSide, kSide, 1);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double code =
          220.0 * painted.curve(pixel_light(sides, x, y)) + 10.0 + noise * normal(random);
      grey.at(x, y) = static_cast<std::uint8_t>(std::lround(code));
    }
  }
  return grey;
}

double error_of(const Painted& painted, const Image<std::uint8_t>& grey) {
  const CornerGuess guess{{painted.corner.x + 0.4, painted.corner.y - 0.3},
                          painted.first + 0.08,
                          painted.second - 0.08,
                          0.7};
  const auto found = fit_corner(grey, guess, 10.0);
  if (!found) return std::nan("");
  return std::hypot(found->place.x - painted.corner.x, found->place.y - painted.corner.y);
}

TEST(FitCorner, FindsThePlaceWhereverItLiesInItsPixelAndHoweverTheEdgesRun) {
  for (int i = 0; i < 8; ++i) {
    const double first = 0.35 * i;
    const Painted painted{{20.0 + 0.13 * i, 20.9 - 0.11 * i}, first, first + 1.2 + 0.08 * i};
    EXPECT_LT(error_of(painted, paint(painted, 0.5)), kWithin) << i;
  }
}

TEST(FitCorner, ACurveBetweenLightAndCodesDoesNotMoveIt) {
  Painted painted{{20.3, 20.7}};
  painted.curve = [](double light) { return std::pow(light, 1.0 / 2.2); };
  EXPECT_LT(error_of(painted, paint(painted, 0.5)), kWithin);
}

TEST(FitCorner, TellsTheBlur) {
  const Painted painted{{20.3, 20.7}};
  const auto found = fit_corner(paint(painted, 0.0), {painted.corner, 0.1, 1.5, 0.5}, 10.0);
  ASSERT_TRUE(found);
  // The lens's and the pixel's variances add up.
  EXPECT_NEAR(found->blur_px, std::sqrt(kBlur * kBlur + 1.0 / 12.0), 0.05);
}

TEST(FitCorner, WhereThereIsNoneItSaysSo) {
  EXPECT_FALSE(fit_corner(Image<std::uint8_t>(kSide, kSide, 1, 90), {{20, 20}, 0.0, 1.5}, 10.0));
  Image<std::uint8_t> noise(kSide, kSide, 1);
  std::mt19937 random(1);
  for (auto& code : noise.samples()) code = static_cast<std::uint8_t>(random() % 256U);
  EXPECT_FALSE(fit_corner(noise, {{20, 20}, 0.0, 1.5}, 10.0));
}

TEST(FitCorner, NearTheBorderOfThePictureThereIsTooLittleToSee) {
  const Painted painted{{20.0, 20.0}};
  EXPECT_FALSE(fit_corner(paint(painted, 0.0), {{5.0, 20.0}, 0.1, 1.5}, 10.0));
}

}  // namespace
}  // namespace opaline::calibration
