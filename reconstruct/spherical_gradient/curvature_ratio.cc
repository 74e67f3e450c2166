#include "reconstruct/spherical_gradient/curvature_ratio.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// int_a^b f by `panels` panels of 5-point Gauss-Legendre.
template <class F>
double integral(double a, double b, int panels, F f) {
  constexpr std::array kNodes{0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr std::array kWeights{0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  const double half = 0.5 * (b - a) / panels;
  double sum = 0.0;
  for (int panel = 0; panel < panels; ++panel) {
    const double middle = a + (2 * panel + 1) * half;
    sum += kWeights[0] * f(middle);
    for (int n = 1; n < 3; ++n)
      sum += kWeights[n] * (f(middle - half * kNodes[n]) + f(middle + half * kNodes[n]));
  }
  return half * sum;
}

/// int Ft mu^power dmu over the hemisphere's cosines, for light that arrives from outside.
double transmitted_moment(double ior, int power) {
  // mu = s^2 takes the square root at grazing light away
  return integral(0.0, 1.0, 200, [&](double s) {
    const double mu = s * s;
    return (1.0 - diffusion::fresnel_reflectance(mu, ior)) * std::pow(mu, power) * 2.0 * s;
  });
}

double decay(double reduced_albedo) { return std::sqrt(3.0 * (1.0 - reduced_albedo)); }

/// int_0^oo R_p(c, s) s cos(k s) ds of one point source at depth c: all lengths in units of c, s = sinh v.
double point_source(double c, double sigma, double k) {
  constexpr double kDeep = 45.0;  // e^-45 is nothing to a double
  const double end = std::acosh(1.0 + kDeep / std::max(sigma * c, 1e-3));
  return integral(0.0, end, 2000, [&](double v) {
    const double u = std::cosh(v);
    const double s = std::sinh(v);
    return (1.0 + sigma * c * u) * std::exp(-sigma * c * u) / (u * u) * std::cos(k * c * s) * s;
  });
}

}  // namespace

Result<CurvatureRatio> CurvatureRatio::make(double ior) {
  if (!(ior >= 1.0 && ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", ior));
  const double reflected = diffusion::internal_moments(ior).fluence;
  const double a = (1.0 + reflected) / (1.0 - reflected);
  return CurvatureRatio(transmitted_moment(ior, 1) / transmitted_moment(ior, 2), 4.0 / 3.0 * a);
}

double CurvatureRatio::diffuse_albedo(double reduced_albedo) const {
  const double g = decay(reduced_albedo);
  return 0.5 * reduced_albedo * (1.0 + std::exp(-b_ * g)) * std::exp(-g);
}

Result<double> CurvatureRatio::reduced_albedo(double diffuse_albedo) const {
  if (!(diffuse_albedo >= 0.0 && diffuse_albedo <= 1.0))
    return invalid_argument(fmt::format("diffuse albedo {}; expected 0 to 1", diffuse_albedo));
  // In g = sqrt(3 (1 - alpha')) the albedo has a slope everywhere; it falls, so halving never fails.
  double low = 0.0;
  double high = std::sqrt(3.0);
  while (high - low > 4e-16 * high) {
    const double g = 0.5 * (low + high);
    if (g == low || g == high) break;
    (this->diffuse_albedo(1.0 - g * g / 3.0) > diffuse_albedo ? low : high) = g;
  }
  const double g = 0.5 * (low + high);
  return 1.0 - g * g / 3.0;
}

double CurvatureRatio::ratio(double reduced_albedo, double bend) const {
  const double g = decay(reduced_albedo);
  if (bend == 0.0) return flat_ratio_;
  const double image = std::exp(-b_ * g);
  const double t = 9.0 * bend * bend / g;
  const double left = 1.0 - t * (1.0 + image + b_ * image) / (1.0 + image);
  return left > 0.0 ? flat_ratio_ / left : kInfinite;
}

double CurvatureRatio::ratio_by_quadrature(double reduced_albedo, double bend) const {
  const double real = 3.0;  // lengths in units of D
  const double image = real * (1.0 + b_);
  const double sigma = decay(reduced_albedo) / 3.0;
  const auto reflected = [&](double k) {
    return point_source(real, sigma, k) + point_source(image, sigma, k);
  };
  const double bent = reflected(bend);
  return bent > 0.0 ? flat_ratio_ * reflected(0.0) / bent : kInfinite;
}

Result<double> CurvatureRatio::bend(double reduced_albedo, double ratio) const {
  if (!(ratio >= flat_ratio_))
    return invalid_argument(
        fmt::format("ratio {:.5g} is below {:.5g}, that of a flat surface", ratio, flat_ratio_));
  const double g = decay(reduced_albedo);
  const double image = std::exp(-b_ * g);
  const double z = 1.0 + image;
  return std::sqrt(g * (z - flat_ratio_ * z / ratio) / (z + b_ * image)) / 3.0;
}

double CurvatureRatio::bend_per_ratio(double reduced_albedo, double ratio) const {
  const Result<double> here = bend(reduced_albedo, ratio);
  if (!here || *here == 0.0) return kInfinite;
  // (D k)^2 = c (1 - rho / r), so 2 D k d(D k) = c rho / r^2 dr
  const double c = *here * *here / (1.0 - flat_ratio_ / ratio);
  return 0.5 * c * flat_ratio_ / (ratio * ratio * *here);
}

double unshifted_ratio(double shifted_ratio) { return shifted_ratio / (2.0 - shifted_ratio); }
double shifted_ratio(double ratio) { return 2.0 * ratio / (1.0 + ratio); }

namespace as_published {

double linear_diffusion(double diffuse_albedo, double shifted_ratio, double curvature) {
  const double dark = 1.0 - diffuse_albedo;
  const double slope = (2.0 * dark * dark + 0.75) * (0.8 + 2.0 / (100.0 * curvature));
  return (shifted_ratio - 1.184) * slope / curvature;
}

double diffusion(double reduced_albedo, double shifted_ratio, double curvature, double a) {
  const double g = decay(reduced_albedo);
  const double b = 4.0 / 3.0 * a;
  const double image = std::exp(-b * g);
  const double z = 1.0 + image;
  const double square = g * (z - 1.184 * z / shifted_ratio) / (z + b * image);
  return square > 0.0 ? 2.0 / (3.0 * curvature) * std::sqrt(square) : 0.0;
}

}  // namespace as_published
}  // namespace opaline::reconstruct
