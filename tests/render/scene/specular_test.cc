#include "render/scene/specular.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace opaline::render {
namespace {

Vec3 direction(double cosine, double azimuth) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

/// int f(w) (n.w) dw over the half space, midpoint rule in azimuth and in t, cosine = 1 - t^2, which is dense about the pole.
double half_space(const std::function<double(Vec3)>& f) {
  constexpr int kSteps = 400;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) / kSteps;
    const double cosine = 1.0 - t * t;
    for (int j = 0; j < kSteps; ++j) {
      const double azimuth = 2.0 * std::numbers::pi * (j + 0.5) / kSteps;
      sum += f(direction(cosine, azimuth)) * cosine * 2.0 * t;
    }
  }
  return sum * 2.0 * std::numbers::pi / (kSteps * kSteps);
}

constexpr Vec3 kNormal{0.0, 0.0, 1.0};

TEST(Specular, TheFacetsOfARoughSurfaceCoverItOnce) {
  for (const double m : {0.1, 0.3, 0.8}) {
    EXPECT_NEAR(half_space([m](Vec3 h) { return beckmann(h.z, m); }), 1.0, 1e-3) << m;
  }
}

TEST(Specular, MirrorsTheSameBothWays) {
  const Vec3 a = direction(0.9, 0.3);
  const Vec3 b = direction(0.4, 2.0);
  for (const auto model : {SpecularModel::kCookTorrance, SpecularModel::kWard}) {
    const SurfaceOptions surface{model, 0.4};
    EXPECT_GT(specular_brdf(surface, 1.4, kNormal, a, b), 0.0);
    EXPECT_DOUBLE_EQ(specular_brdf(surface, 1.4, kNormal, a, b),
                     specular_brdf(surface, 1.4, kNormal, b, a));
  }
}

// A nearly smooth surface mirrors Fresnel's share of perpendicular light, ((n - 1) / (n + 1))^2.
TEST(Specular, ASmoothSurfaceMirrorsFresnelsShareAndNoneMoreThanAll) {
  for (const auto model : {SpecularModel::kCookTorrance, SpecularModel::kWard}) {
    const auto mirrored = [&](double m, double cosine) {
      const Vec3 view = direction(cosine, 0.0);
      return half_space([&](Vec3 l) { return specular_brdf({model, m}, 1.5, kNormal, l, view); });
    };
    EXPECT_NEAR(mirrored(0.06, 1.0), 0.04, 0.001);
    for (const double cosine : {0.2, 0.5, 0.9}) EXPECT_LT(mirrored(0.3, cosine), 1.0);
  }
}

TEST(Specular, NothingIsMirroredFromBelowOrByTheSameIndex) {
  const SurfaceOptions surface;
  EXPECT_EQ(specular_brdf(surface, 1.5, kNormal, direction(-0.1, 0.0), kNormal), 0.0);
  EXPECT_EQ(specular_brdf(surface, 1.0, kNormal, kNormal, kNormal), 0.0);
}

}  // namespace
}  // namespace opaline::render
