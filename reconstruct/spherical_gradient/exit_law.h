#pragma once

#include <algorithm>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {

/// Radiance over exitance / pi of light that arrives evenly below a surface, (1 - F(mu)) / (2 int (1 - F) mu dmu), mu the cosine outside; not below 0.05.
/// Threads: const, any number.
class ExitLaw {
 public:
  explicit ExitLaw(double ior) : ior_(ior) {
    constexpr int kSteps = 2000;
    double kept = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double mu = (i + 0.5) / kSteps;
      kept += 2.0 * mu * (1.0 - diffusion::fresnel_reflectance(mu, ior)) / kSteps;
    }
    mean_ = kept;
  }
  double at(double cosine) const {
    const double mu = std::clamp(cosine, 0.05, 1.0);
    return (1.0 - diffusion::fresnel_reflectance(mu, ior_)) / mean_;
  }

 private:
  double ior_;
  double mean_ = 1.0;
};

}  // namespace opaline::reconstruct
