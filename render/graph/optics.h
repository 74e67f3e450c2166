#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/result.h"

namespace opaline::render {

/// What the diffusion equation needs to know of the material at one place: red,
/// green, blue.
struct Optics {
  std::array<double, 3> diffusion{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};  ///< kappa, mm, > 0
  std::array<double, 3> absorption{};                                ///< sigma_a, 1/mm, >= 0
};

/// The light field on a surface, one value a surface node (or vertex) and
/// channel: what the camera equation takes.
struct SurfaceLight {
  std::vector<std::array<float, 3>> fluence;  ///< phi_s, W/mm^2
  std::vector<std::array<float, 3>>
      net_flux;  ///< J_n, outwards positive, W/mm^2; exitance M = q + J_n
};

/// Errors: kInvalidArgument, naming the place, for a coefficient that is out of
/// range or not finite.
Result<void> validate(std::span<const Optics> optics);

}  // namespace opaline::render
