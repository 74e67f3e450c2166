#pragma once

#include <vector>

namespace opaline::reconstruct::diffusion {

/// A half space that scatters isotropically under a Fresnel surface, lit perpendicularly, by the transport equation:
///
///   mu dJ/dtau = -J + alpha' (phi + q e^(-tau)),   phi = 1/2 int J dmu,   J(0, mu) = R(mu) J(0, -mu) for mu > 0
///
/// (J = 4 pi times the radiance inside, mu inwards). Discrete ordinates (Chandrasekhar 1950, chapter III) on 16 Gauss nodes
/// either side of the critical cosine: J is a sum of modes e^(-lambda tau) alpha' / (1 - lambda mu), their lambda the
/// roots of  alpha' sum_i w_i / (1 - lambda^2 mu_i^2) = 1,  and of what the beam drives, e^(-tau). Doubling the nodes
/// changes `emergent` by less than 1e-4.
///
/// Threads: const, so any number at a time.
class HalfSpace {
 public:
  /// `ior` >= 1.
  explicit HalfSpace(double ior);

  /// Phi of the radiance L = F_t / (4 pi eta^2) Phi that leaves at cosine mu_i inside, per transmitted irradiance q: light
  /// scattered once and more. `albedo` is alpha', taken within 0.01 to 1 - 1e-9; `inside_cosine` > 0.
  double emergent(double albedo, double inside_cosine) const;

 private:
  std::vector<double> modes(double albedo) const;

  std::vector<double> cosine_;  // descending
  std::vector<double> weight_;  // of sum 1
  std::vector<double> reflectance_;
};

}  // namespace opaline::reconstruct::diffusion
