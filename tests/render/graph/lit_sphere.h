#pragma once

#include <cmath>

#include "base/pose.h"
#include "reconstruct/diffusion/boundary.h"

namespace opaline::render {

/// A homogeneous sphere lit by q = (1 + cos theta) / 2, exactly: with s =
/// sqrt(sigma_a / kappa) and the modified spherical Bessel functions i0(x) =
/// sinh x / x, i1(x) = (cosh x - i0) / x,
///
///   phi = a0 i0(s r) + a1 i1(s r) cos theta,   (phi + 2 A kappa dphi/dr)(R) =
///   source_scale q
class LitSphere {
 public:
  LitSphere(double radius,
            double diffusion,
            double absorption,
            const reconstruct::diffusion::Boundary& boundary)
      : s_(std::sqrt(absorption / diffusion)) {
    const double x = s_ * radius;
    const double flow = 2.0 * boundary.a * diffusion * s_;
    a0_ = 0.5 * boundary.source_scale / (i0(x) + flow * i1(x));
    a1_ = 0.5 * boundary.source_scale / (i1(x) + flow * (i0(x) - 2.0 * i1(x) / x));
  }
  double fluence(Vec3 p) const {
    const double r = length(p);
    return a0_ * i0(s_ * r) + a1_ * i1(s_ * r) * p.z / r;
  }
  static double irradiance(Vec3 p) { return 0.5 * (1.0 + p.z / length(p)); }

 private:
  static double i0(double x) { return std::sinh(x) / x; }
  static double i1(double x) { return (std::cosh(x) - i0(x)) / x; }
  double s_;
  double a0_ = 0.0;
  double a1_ = 0.0;
};

}  // namespace opaline::render
