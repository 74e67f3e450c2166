#include "reconstruct/spherical_gradient/pixel_ratio.h"

#include <array>
#include <cmath>

namespace opaline::reconstruct {
namespace {

/// r = C S^(-1/2) of one pixel, S = sum L_i^2 less what noise adds to it, L_i = 2 P_i - C; to second order without the bias that noise
/// gives to it, 3/8 var(S)/S^2 and the covariance of C with S.
struct PixelRatio {
  std::array<double, 3> gradient{};
  double square = 0.0;             ///< S; nothing below is set where it is not above 0
  double gradient_variance = 0.0;  ///< sum of the components'
  double ratio = 0.0;
  double variance = 0.0;
};

PixelRatio ratio_of(const GradientPictures& p, std::size_t at) {
  PixelRatio r;
  const double constant = p.radiance[0][at];
  const double constant_variance = p.variance[0][at];
  for (std::size_t n = 0; n < 3; ++n) {
    r.gradient[n] = 2.0 * p.radiance[n + 1][at] - constant;
    r.square += r.gradient[n] * r.gradient[n];
    r.gradient_variance += 4.0 * p.variance[n + 1][at] + constant_variance;
  }
  r.square -= r.gradient_variance;
  if (!(r.square > 0.0)) return r;
  const double root = std::sqrt(r.square);
  const double tilt = (r.gradient[0] + r.gradient[1] + r.gradient[2]) / root;
  const double by_constant = (1.0 + constant * tilt / root) / root;
  r.variance = by_constant * by_constant * constant_variance;
  double along = tilt * tilt * constant_variance;  // variance of L's length
  for (std::size_t n = 0; n < 3; ++n) {
    const double cosine = r.gradient[n] / root;
    const double by_gradient = 2.0 * constant * cosine / r.square;
    r.variance += by_gradient * by_gradient * p.variance[n + 1][at];
    along += 4.0 * cosine * cosine * p.variance[n + 1][at];
  }
  const double bias = 1.5 * along / r.square + tilt * constant_variance / (constant * root);
  r.ratio = constant / root * (1.0 - bias);
  return r;
}

/// Of n_x and n_y, on average. What noise adds along the normal n does not turn it: with a = e_x - n_x n, the variance of n_x is
/// sum_i a_i^2 4 var(P_i) / S + (sum_i a_i)^2 var(C) / S, C being in all three of L_i = 2 P_i - C.
double normal_variance(const GradientPictures& p,
                       std::size_t at,
                       const std::array<double, 3>& normal,
                       double square) {
  double sum = 0.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    double across = 0.0;
    for (std::size_t n = 0; n < 3; ++n) {
      const double a = (n == axis ? 1.0 : 0.0) - normal[axis] * normal[n];
      sum += 4.0 * a * a * p.variance[n + 1][at];
      across += a;
    }
    sum += across * across * p.variance[0][at];
  }
  return 0.5 * sum / square;
}

}  // namespace

void measure_pixel(const GradientPictures& p,
                   std::size_t at,
                   PixelValues& values,
                   ScatteringMaps& maps) {
  if (p.measured[at] == kClipped) maps.left_out[at] = LeftOut::kSaturated;
  if (p.measured[at] != kMeasured || !(p.radiance[0][at] > 0.0F)) return;
  const PixelRatio r = ratio_of(p, at);
  if (!(r.square > 0.0)) return;
  const double length = std::sqrt(r.square + r.gradient_variance);
  const std::array normal{r.gradient[0] / length, r.gradient[1] / length, r.gradient[2] / length};
  maps.normal_x[at] = static_cast<float>(normal[0]);
  maps.normal_y[at] = static_cast<float>(normal[1]);
  maps.normal_z[at] = static_cast<float>(normal[2]);
  values.normal_x[at] = maps.normal_x[at];
  values.normal_y[at] = maps.normal_y[at];
  values.normal_variance[at] = static_cast<float>(normal_variance(p, at, normal, r.square));
  values.ratio[at] = static_cast<float>(r.ratio);
  values.ratio_variance[at] = static_cast<float>(r.variance);
  values.reflectance[at] = static_cast<float>(p.radiance[0][at] / p.white);
  values.reflectance_variance[at] = static_cast<float>(p.variance[0][at] / (p.white * p.white));
  values.measured[at] = 1;
}

}  // namespace opaline::reconstruct
