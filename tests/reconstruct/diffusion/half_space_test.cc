#include "reconstruct/diffusion/half_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr int kPoints = 2000;  // midpoint rule

double point(int i) { return (i + 0.5) / kPoints; }

/// Chandrasekhar's H for isotropic scattering, by iterating 1/H = sqrt(1 - c) + c/2 int x H(x) / (mu + x) dx.
std::vector<double> chandrasekhar_h(double c) {
  std::vector<double> h(kPoints, 1.0);
  for (int round = 0; round < 200; ++round) {
    std::vector<double> next(kPoints);
    double change = 0.0;
    for (int i = 0; i < kPoints; i += 1) {
      double sum = 0.0;
      for (int j = 0; j < kPoints; ++j) sum += point(j) * h[j] / (point(i) + point(j));
      next[i] = 1.0 / (std::sqrt(1.0 - c) + 0.5 * c * sum / kPoints);
      change = std::max(change, std::abs(next[i] - h[i]));
    }
    h = std::move(next);
    if (change < 1e-9) break;
  }
  return h;
}

// The law of reflection, L = q c H(mu) H(1) / (4 pi (1 + mu)) (Chandrasekhar 1950, section 39). The midpoint rule is off
// by 1e-6, discrete ordinates by 1e-4.
TEST(HalfSpace, ReflectsByTheLawOfReflectionWhereNothingIsReflectedInside) {
  const HalfSpace half_space(1.0);
  for (const double c : {0.3, 0.8}) {
    const std::vector<double> h = chandrasekhar_h(c);
    for (const int i : {600, 1200, 1900}) {
      const double mu = point(i);
      const double exact = c * h[i] * h[kPoints - 1] / (mu + point(kPoints - 1));
      EXPECT_NEAR(half_space.emergent(c, mu), exact, 3e-4 * exact) << c << ", " << mu;
    }
  }
}

// What is absorbed goes as the root of 1 - c: 1e-8 leaves some 5e-4.
TEST(HalfSpace, SendsBackAllLightThatIsNotAbsorbed) {
  for (const double ior : {1.0, 1.3, 1.8}) {
    const HalfSpace half_space(ior);
    double out = 0.0;
    constexpr int kAngles = 1000;
    for (int i = 0; i < kAngles; ++i) {
      const double outside = (i + 0.5) / kAngles;  // mu dmu = mu_o dmu_o / eta^2
      const double mu = refracted_cosine(outside, ior);
      out += 0.5 * (1.0 - fresnel_reflectance(outside, ior)) * half_space.emergent(1.0 - 1e-8, mu) *
             outside / (ior * ior) / kAngles;
    }
    EXPECT_NEAR(out, 1.0, 1.5e-3) << ior;
  }
}

}  // namespace
}  // namespace opaline::reconstruct::diffusion
