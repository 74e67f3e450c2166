#pragma once

#include "base/pose.h"

namespace opaline::calibration {

/// c_from_a.
inline Pose chained(const Pose& c_from_b, const Pose& b_from_a) {
  Pose out;
  const auto& l = c_from_b.rotation;
  const auto& r = b_from_a.rotation;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      out.rotation[3 * i + j] = l[3 * i] * r[j] + l[3 * i + 1] * r[3 + j] + l[3 * i + 2] * r[6 + j];
  }
  out.translation = c_from_b.apply(b_from_a.translation);
  return out;
}

}  // namespace opaline::calibration
