#pragma once

namespace opaline::reconstruct::diffusion {

/// Unpolarised power reflectance of a plane dielectric surface (Fresnel; Born & Wolf, Principles of
/// Optics, 1.5.2), for light that arrives in medium 1 at `cosine` to the normal; `relative_index` =
/// n2 / n1. 1 on total reflection.
double fresnel_reflectance(double cosine, double relative_index);

/// R(0) = ((eta - 1) / (eta + 1))^2: what a surface mirrors of light at perpendicular incidence.
double normal_reflectance(double ior);

/// The cosine inside the material, mu_i = sqrt(1 - (1 - mu_o^2) / eta^2), of light at mu_o outside
/// (Snell).
double refracted_cosine(double outside_cosine, double ior);

/// Internal Fresnel moments, by Gauss-Legendre quadrature in the outside cosine:
///   R_phi = 2 int_0^1 R mu dmu (Fdr of the literature),   R_j = 3 int_0^1 R mu^2 dmu
/// (Haskell et al., JOSA A 11, 2727 (1994), Eqs. 2.3.5 and 2.3.6), R seen from inside a material of
/// index `ior` >= 1.
struct FresnelMoments {
  double fluence = 0.0;  ///< R_phi
  double flux = 0.0;     ///< R_j
};
FresnelMoments internal_moments(double ior);

}  // namespace opaline::reconstruct::diffusion
