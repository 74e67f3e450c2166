#include "calibration/color_difference.h"

#include <cmath>
#include <numbers>

namespace opaline::calibration {
namespace {

constexpr double kKnee = 6.0 / 29.0;
constexpr double kDegree = std::numbers::pi / 180.0;

double compressed(double t) {
  return t > kKnee * kKnee * kKnee ? std::cbrt(t) : t / (3.0 * kKnee * kKnee) + 4.0 / 29.0;
}

double expanded(double f) { return f > kKnee ? f * f * f : 3.0 * kKnee * kKnee * (f - 4.0 / 29.0); }

// Of chroma: what greys are stretched by, and what blues are turned by.
double saturation(double chroma) {
  const double seventh = std::pow(chroma, 7.0);
  return std::sqrt(seventh / (seventh + std::pow(25.0, 7.0)));
}

double hue(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double degrees = std::atan2(b, a) / kDegree;
  return degrees < 0.0 ? degrees + 360.0 : degrees;
}

double hue_difference(double first, double second) {
  const double difference = second - first;
  if (difference > 180.0) return difference - 360.0;
  return difference < -180.0 ? difference + 360.0 : difference;
}

double mean_hue(double first, double second) {
  if (std::abs(first - second) <= 180.0) return 0.5 * (first + second);
  return 0.5 * (first + second + (first + second < 360.0 ? 360.0 : -360.0));
}

}  // namespace

Lab lab_from_xyz(const Xyz& xyz, const Xyz& white) {
  const double x = compressed(xyz[0] / white[0]);
  const double y = compressed(xyz[1] / white[1]);
  const double z = compressed(xyz[2] / white[2]);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

Xyz xyz_from_lab(const Lab& lab, const Xyz& white) {
  const double y = (lab[0] + 16.0) / 116.0;
  return {white[0] * expanded(y + lab[1] / 500.0),
          white[1] * expanded(y),
          white[2] * expanded(y - lab[2] / 200.0)};
}

double delta_e_2000(const Lab& first, const Lab& second) {
  const double stretch =
      1.5 -
      0.5 * saturation(0.5 * (std::hypot(first[1], first[2]) + std::hypot(second[1], second[2])));
  const double a1 = stretch * first[1];
  const double a2 = stretch * second[1];
  const double c1 = std::hypot(a1, first[2]);
  const double c2 = std::hypot(a2, second[2]);
  const bool grey = c1 * c2 == 0.0;
  const double h1 = hue(a1, first[2]);
  const double h2 = hue(a2, second[2]);
  const double turned = grey ? 0.0 : hue_difference(h1, h2);
  const double h = grey ? h1 + h2 : mean_hue(h1, h2);
  const double c = 0.5 * (c1 + c2);
  const double from_middle = std::pow(0.5 * (first[0] + second[0]) - 50.0, 2.0);
  const double t = 1.0 - 0.17 * std::cos((h - 30.0) * kDegree) +
                   0.24 * std::cos(2.0 * h * kDegree) + 0.32 * std::cos((3.0 * h + 6.0) * kDegree) -
                   0.20 * std::cos((4.0 * h - 63.0) * kDegree);
  const double turn = 60.0 * std::exp(-std::pow((h - 275.0) / 25.0, 2.0));
  const double lightness =
      (second[0] - first[0]) / (1.0 + 0.015 * from_middle / std::sqrt(20.0 + from_middle));
  const double chroma = (c2 - c1) / (1.0 + 0.045 * c);
  const double hues =
      2.0 * std::sqrt(c1 * c2) * std::sin(0.5 * turned * kDegree) / (1.0 + 0.015 * c * t);
  const double crossed = -2.0 * saturation(c) * std::sin(turn * kDegree) * chroma * hues;
  return std::sqrt(lightness * lightness + chroma * chroma + hues * hues + crossed);
}

}  // namespace opaline::calibration
