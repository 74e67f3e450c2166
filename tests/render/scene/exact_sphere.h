#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "reconstruct/diffusion/boundary.h"

namespace opaline::render {

/// The fluence on a homogeneous sphere's surface under light q(cos theta), exactly: with s = sqrt(sigma_a / kappa), x = s R
/// and the modified spherical Bessel functions i_l of the first kind,
///
///   q = sum q_l P_l(cos theta),   phi(R) = sum source_scale q_l / (1 + 2 A kappa s i_l'(x) / i_l(x)) P_l(cos theta)
///
/// i_l'/i_l = l / x + i_(l+1)/i_l; the ratio by its continued fraction, from below (Abramowitz & Stegun, 10.2.18).
class ExactSphere {
 public:
  ExactSphere(double radius,
              double diffusion,
              double absorption,
              const reconstruct::diffusion::Boundary& boundary,
              const std::function<double(double)>& q)
      : boundary_(boundary) {
    const double s = std::sqrt(absorption / diffusion);
    const double x = s * radius;
    double ratio = 0.0;  // i_(l+1) / i_l
    std::vector<double> ratios(kTerms);
    for (int l = kTerms + 50; l >= 0; --l) {
      ratio = 1.0 / ((2.0 * l + 3.0) / x + ratio);
      if (l < kTerms) ratios[l] = ratio;
    }
    for (int l = 0; l < kTerms; ++l) {
      const double slope = l / x + ratios[l];
      terms_.push_back(boundary.source_scale * part(q, l) /
                       (1.0 + 2.0 * boundary.a * diffusion * s * slope));
    }
  }

  double fluence(double cosine) const {
    double sum = 0.0;
    for (int l = 0; l < kTerms; ++l) sum += terms_[l] * legendre(l, cosine);
    return sum;
  }
  /// J_n = (phi - source_scale q) / (2 A)
  double net_flux(double cosine, double q) const {
    return (fluence(cosine) - boundary_.source_scale * q) / (2.0 * boundary_.a);
  }

 private:
  static constexpr int kTerms = 60;

  static double legendre(int l, double x) {
    double before = 1.0;
    double now = x;
    if (l == 0) return before;
    for (int n = 2; n <= l; ++n) {
      const double next = ((2.0 * n - 1.0) * x * now - (n - 1.0) * before) / n;
      before = now;
      now = next;
    }
    return now;
  }

  /// (2 l + 1) / 2 int q P_l dx, by the midpoint rule.
  static double part(const std::function<double(double)>& q, int l) {
    constexpr int kSteps = 4000;
    double sum = 0.0;
    for (int k = 0; k < kSteps; ++k) {
      const double x = -1.0 + 2.0 * (k + 0.5) / kSteps;
      sum += q(x) * legendre(l, x);
    }
    return (2.0 * l + 1.0) / 2.0 * sum * 2.0 / kSteps;
  }

  reconstruct::diffusion::Boundary boundary_;
  std::vector<double> terms_;
};

/// Fresnel's transmitted share of unpolarised light that arrives from outside, by amplitudes.
inline double transmitted(double cosine, double ior) {
  if (cosine <= 0.0) return 0.0;
  const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / (ior * ior));
  const double s = 2.0 * cosine / (cosine + ior * inside);
  const double p = 2.0 * cosine / (ior * cosine + inside);
  return 0.5 * ior * inside / cosine * (s * s + p * p);
}

}  // namespace opaline::render
