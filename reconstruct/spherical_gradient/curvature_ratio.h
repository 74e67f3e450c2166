#pragma once

#include "base/result.h"

namespace opaline::reconstruct {

/// What a curved translucent surface shows under spherical gradient illumination, by the dipole (Zhu et al. 2013, IEEE CG&A 33(4);
/// docs/physics.md says where its print is wrong). Light that has scattered more than once only: the pictures are cross-polarised.
///
/// With L_1 the radiance under constant light 1 and L_n that under the gradient omega . n, n the normal at the point seen,
///
///   r = L_1 / L_n = rho R_c(0) / R_c(k),   R_c(k) = int_0^oo R_d(s) s cos(k s) ds          (Eqs. 2 to 4)
///
/// k the mean curvature (1/mm), R_d(s) the dipole's diffuse reflectance at a distance, and rho = int Ft mu dmu / int Ft mu^2 dmu the ratio
/// of a surface that is flat or opaque: 1.45619 at an index of 1.4. With the cosine's Taylor series to second order, D the diffusion
/// coefficient 1 / (3 sigma_t') (the paper's D), g = sqrt(3 (1 - alpha')), b = 4 A / 3, z = 1 + e^(-b g) and t = (3 D k)^2 / g,
///
///   R_c(k) = alpha'/(4 pi) e^(-g) [ (1 - t) + (1 - t (1 + b)) e^(-b g) ]                   (Eq. 6, corrected)
///   D = 1/(3 k) sqrt( g (z - rho z / r) / (z + b e^(-b g)) )                               (Eq. 7, with rho computed)
///
/// Lengths that go with D: sigma_tr = g / (3 D), translucency l_d = 1 / sigma_tr.
class CurvatureRatio {
 public:
  /// Errors: kInvalidArgument when `ior` is not within 1 to 3.
  static Result<CurvatureRatio> make(double ior);

  double flat_ratio() const { return flat_ratio_; }  ///< rho

  /// Diffuse albedo of the reduced one, R_d = alpha'/2 (1 + e^(-b g)) e^(-g)  (Eq. 5); 0 <= alpha' <= 1.
  double diffuse_albedo(double reduced_albedo) const;
  /// The way back. Errors: kInvalidArgument when `diffuse_albedo` is not within 0 to 1.
  Result<double> reduced_albedo(double diffuse_albedo) const;

  /// r by Eq. 6; `bend` = D k >= 0. Infinite where the series has no light left (t too large).
  double ratio(double reduced_albedo, double bend) const;
  /// r by the integral itself: what Eq. 6 approximates.
  double ratio_by_quadrature(double reduced_albedo, double bend) const;

  /// D k of a ratio, by Eq. 7. Errors: kInvalidArgument when r < rho: more light from the side than a flat surface of any
  /// material has, so noise, a concave place or interreflection.
  Result<double> bend(double reduced_albedo, double ratio) const;
  /// d(D k)/dr there, infinite at r = rho: what an error of the ratio does.
  double bend_per_ratio(double reduced_albedo, double ratio) const;

 private:
  CurvatureRatio(double flat_ratio, double b) : flat_ratio_(flat_ratio), b_(b) {}

  double flat_ratio_;
  double b_;  // 4 A / 3, A = (1 + Fdr) / (1 - Fdr)
};

/// The patterns are (omega + 1)/2, shifted into what light can be: r from r' = L_1 / |L'| with L' the shifted pictures' length, exactly
/// r = r' / (2 - r').
double unshifted_ratio(double shifted_ratio);
double shifted_ratio(double ratio);

/// The formulas as the paper prints them for the shifted ratio, for comparison: D in mm of a mean curvature in 1/mm.
namespace as_published {
/// Eq. 1: linear, with the fitted slope.
double linear_diffusion(double diffuse_albedo, double shifted_ratio, double curvature);
/// Eq. 7 for shifted patterns, with its 1.184; 0 below that. `a` is the boundary constant A.
double diffusion(double reduced_albedo, double shifted_ratio, double curvature, double a);
}  // namespace as_published

}  // namespace opaline::reconstruct
