#include "reconstruct/spherical_gradient/shared_deviations.h"

#include <cmath>

namespace opaline::reconstruct {

SharedDeviations shared_deviations(double of_one, double lamps, double of_white) {
  const double of_all = of_one / std::sqrt(0.5 * lamps);
  return {.ratio = of_all * std::sqrt(2.0 / 15.0),
          .reflectance = std::hypot(of_white, of_all * std::sqrt(4.0 / 3.0)),
          .curvature = of_all * std::sqrt(9.0 / 5.0)};
}

}  // namespace opaline::reconstruct
