#include "render/graph/optics.h"

#include <fmt/format.h>

#include <cmath>

namespace opaline::render {

Result<void> validate(std::span<const Optics> optics) {
  for (std::size_t i = 0; i < optics.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double kappa = optics[i].diffusion[c];
      const double sigma = optics[i].absorption[c];
      if (!(kappa > 0.0) || !std::isfinite(kappa) || !(sigma >= 0.0) || !std::isfinite(sigma)) {
        return invalid_argument(fmt::format(
            "place {}: kappa = {} mm, sigma_a = {} 1/mm; expected > 0 and >= 0", i, kappa, sigma));
      }
    }
  }
  return ok();
}

}  // namespace opaline::render
