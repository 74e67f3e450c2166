#include "reconstruct/spherical_gradient/lamp_shapes.h"

#include <numbers>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

using std::numbers::pi;

constexpr int kDegrees = 48;

/// a_l of Ft(mu) max(mu, 0) = sum a_l P_l(mu), by the midpoint rule in 4000 steps.
std::vector<double> coefficients(double ior) {
  constexpr int kSteps = 4000;
  std::vector<double> a(kDegrees + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    const double f = (1.0 - diffusion::fresnel_reflectance(mu, ior)) * mu / kSteps;
    double before = 1.0;
    double now = mu;
    a[0] += 0.5 * f;
    a[1] += 1.5 * f * mu;
    for (int l = 2; l <= kDegrees; ++l) {
      const double next = ((2.0 * l - 1.0) * mu * now - (l - 1.0) * before) / l;
      before = now;
      now = next;
      a[static_cast<std::size_t>(l)] += (l + 0.5) * f * now;
    }
  }
  return a;
}
double value(const std::vector<double>& a, double damping, double mu) {
  double before = 1.0;
  double now = mu;
  double sum = a[0] + a[1] * mu / (1.0 + 2.0 * damping);
  for (int l = 2; l <= kDegrees; ++l) {
    const double next = ((2.0 * l - 1.0) * mu * now - (l - 1.0) * before) / l;
    before = now;
    now = next;
    sum += a[static_cast<std::size_t>(l)] * now / (1.0 + l * (l + 1.0) * damping);
  }
  return sum;
}

}  // namespace

LampShapes::LampShapes(double ior) : tables_(kShapes) {
  const std::vector<double> sharp = coefficients(ior);
  flat_ = sharp[0] / (sharp[1] / 3.0);
  for (std::size_t n = 0; n < kShapes; ++n) {
    const double damping = kMostDamping * std::pow(static_cast<double>(n) / (kShapes - 1), 2);
    for (std::size_t i = 0; i <= kCosines; ++i)
      tables_[n][i] =
          static_cast<float>(value(sharp, damping, 2.0 * static_cast<double>(i) / kCosines - 1.0));
    whole_[n] = 4.0 * pi * sharp[0];
    slanted_[n] = 4.0 * pi * sharp[1] / 3.0 / (1.0 + 2.0 * damping);
  }
}

}  // namespace opaline::reconstruct
