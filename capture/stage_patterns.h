#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/light_sphere.h"
#include "base/result.h"

namespace opaline::capture {

/// Weights with which a sum over directions is an integral over the sphere, sum_j w_j f(omega_j) = int f domega, for every polynomial f up to
/// `degree` (fewer where the directions cannot), as near as they can be to 4 pi / N each. By the addition theorem, with
/// K_ij = sum_(l <= degree) (2 l + 1)/(4 pi) P_l(omega_i . omega_j), they minimise w^T K w - 2 sum w + e |w - 4 pi / N|^2, e = 1e-6.
///
/// The degree falls until no weight is below 0.2 or above 3 times the mean: a hole in the sphere is made up for by its rim, as far as lamps can.
struct SphereWeights {
  std::vector<double> weights;
  int degree = 0;  ///< reached
};
/// The highest degree that N directions may determine is taken to be floor(sqrt(N) / 2). `directions` are unit vectors.
SphereWeights sphere_weights(std::span<const Vec3> directions);

/// A pattern of a light stage.
struct StageLight {
  std::string name;
  std::vector<std::uint8_t> codes;
  bool parallel = false;
};

struct StagePatternOptions {
  bool split =
      false;  ///< gradients as two halves, max(omega, 0) and max(-omega, 0), instead of (1 + omega)/2
  bool specular = true;  ///< a constant pattern with parallel polarisers, too
};

/// The patterns of spherical gradient illumination (Ma et al. 2007) along `axes`: "constant", "gradient_x", "gradient_y", "gradient_z" (or
/// "gradient_x_plus", "gradient_x_minus", ...), "constant_parallel", and "constant_again" last, for the drift.
///
/// Affine-corrected: every lamp's code is in proportion to its weight over its irradiance in the middle, so that what falls there has the pattern's
/// moments whatever the lamps' places, distances and brightness; rounded to whole codes, the brightest at 255. A lamp of intensity 0 stays
/// dark, and the others make up for it.
/// Errors: kInvalidArgument for fewer than 12 lamps, or one in the middle.
Result<std::vector<StageLight>> stage_patterns(std::span<const SphereLight> lights,
                                               const std::array<Vec3, 3>& axes,
                                               const StagePatternOptions& options);

/// "beam": the last of so many lights alone, at full code. `lights` > 0.
StageLight beam_alone(std::size_t lights);

/// Radiance of the even surroundings that a pattern amounts to: sum of code/255 I / d^2 over 4 pi, W/(mm^2 sr).
double mean_radiance(std::span<const SphereLight> lights, std::span<const std::uint8_t> codes);

}  // namespace opaline::capture
