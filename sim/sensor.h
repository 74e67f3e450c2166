#pragma once

#include <cstdint>

#include "base/image.h"
#include "sim/hash.h"
#include "sim/optics.h"

namespace opaline::sim {

/// The standard normal distribution's quantile, |error| < 1e-7 of it (Wichura 1988, AS 241, PPND7).
double normal_quantile(double probability);
/// The Poisson distribution's quantile: by summation up to a mean of 32, above by Cornish and
/// Fisher's expansion (1938) to second order, m + sqrt(m) z + (z^2 - 1)/6.
double poisson_quantile(double mean, double probability);

/// The simulated camera's electronics: from light to codes, as CameraOptics says.
class Sensor {
 public:
  Sensor(const CameraOptics& options, std::uint64_t seed);

  /// What one exposure reads. `light` is the time integral of the radiance at each pixel, 3
  /// channels, W s/(mm^2 sr); `key` decides the noise.
  Image<std::uint16_t> read(const Image<float>& light, double seconds, std::uint64_t key) const;

 private:
  double noisy_electrons(double mean, std::uint64_t hash) const;
  std::uint16_t code(double electrons) const;

  CameraOptics options_;
  Image<float> vignetting_;
  Image<float> leak_;  ///< electrons per second without light, 3 channels
};

}  // namespace opaline::sim
