#include "render/mesh/turn.h"

#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

Pose turned(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  Pose pose;
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  pose.rotation[3 * i + i] = c;
  pose.rotation[3 * j + j] = c;
  pose.rotation[3 * i + j] = -s;
  pose.rotation[3 * j + i] = s;
  return pose;
}

}  // namespace

Pose chained(const Pose& second, const Pose& first) {
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) sum += second.rotation[3 * i + k] * first.rotation[3 * k + j];
      pose.rotation[3 * i + j] = sum;
    }
  }
  pose.translation = second.apply(first.translation);
  return pose;
}

Pose turned_about_axes(const std::array<double, 3>& degrees) {
  return chained(turned(2, degrees[2]), chained(turned(1, degrees[1]), turned(0, degrees[0])));
}

}  // namespace opaline::render
