#include "reconstruct/diffusion/fresnel.h"

#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/quadrature.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr int kPanels = 64;

template <class Function>
double integrate_unit_interval(const Function& f) {
  double sum = 0.0;
  for_gauss_nodes(kPanels, [&](double x, double weight) { sum += weight * f(x); });
  return sum;
}

}  // namespace

double fresnel_reflectance(double cosine, double relative_index) {
  const double sine_squared = (1.0 - cosine * cosine) / (relative_index * relative_index);
  if (sine_squared >= 1.0) return 1.0;
  const double transmitted = std::sqrt(1.0 - sine_squared);
  const double s =
      (cosine - relative_index * transmitted) / (cosine + relative_index * transmitted);
  const double p =
      (relative_index * cosine - transmitted) / (relative_index * cosine + transmitted);
  return 0.5 * (s * s + p * p);
}

double normal_reflectance(double ior) {
  const double r = (ior - 1.0) / (ior + 1.0);
  return r * r;
}

double refracted_cosine(double outside_cosine, double ior) {
  return std::sqrt(1.0 - (1.0 - outside_cosine * outside_cosine) / (ior * ior));
}

FresnelMoments internal_moments(double ior) {
  ENSURE(ior >= 1.0);
  // mu dmu = mu_o dmu_o / eta^2 inside the critical cone, R = 1 beyond it; mu_o = u^2 resolves
  // grazing angles.
  const double critical = std::sqrt(1.0 - 1.0 / (ior * ior));
  const auto moment = [ior](bool flux) {
    return integrate_unit_interval([ior, flux](double u) {
      const double outside = u * u;
      const double r = fresnel_reflectance(outside, ior);
      return r * outside * 2.0 * u * (flux ? refracted_cosine(outside, ior) : 1.0);
    });
  };
  const double scale = 1.0 / (ior * ior);
  return {critical * critical + 2.0 * scale * moment(false),
          critical * critical * critical + 3.0 * scale * moment(true)};
}

}  // namespace opaline::reconstruct::diffusion
