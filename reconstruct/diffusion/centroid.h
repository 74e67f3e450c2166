#pragma once

#include <cmath>

namespace opaline::reconstruct::diffusion {

/// Where e^(-t x) has its centroid on a cell, x from 0 to 1: a part beta(t) = 1/2 - 1/t + 1/(e^t - 1) of the cell before its
/// middle. t > 0.
struct Centroid {
  explicit Centroid(double optical_length)
      : t(optical_length),
        left(std::exp(-optical_length)),
        lost(optical_length > kThick ? 1.0 - left : -std::expm1(-optical_length)) {}

  double t;
  double left;  ///< e^(-t)
  double lost;  ///< 1 - e^(-t)

  double shift() const {  ///< beta; 1 / (e^t - 1) = left / lost
    const double s = t * t;
    if (t < kSeriesBelow) return t * (1.0 / 12.0 - s / 720.0 + s * s / 30240.0);
    return 0.5 - 1.0 / t + left / lost;
  }
  double shift_slope() const {  ///< dbeta/dt
    const double s = t * t;
    if (t < kSeriesBelow) return 1.0 / 12.0 - s / 240.0 + s * s / 6048.0;
    return 1.0 / s - left / (lost * lost);
  }

 private:
  /// Where the closed forms lose more to cancellation than the series to truncation.
  static constexpr double kSeriesBelow = 0.05;
  static constexpr double kThick = 0.5;  ///< where 1 - e^(-t) loses nothing to cancellation
};

}  // namespace opaline::reconstruct::diffusion
