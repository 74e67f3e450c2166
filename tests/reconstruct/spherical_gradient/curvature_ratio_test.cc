#include "reconstruct/spherical_gradient/curvature_ratio.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

constexpr double kIor = 1.4;

CurvatureRatio ratio_of(double ior = kIor) { return *CurvatureRatio::make(ior); }

/// D of a translucency l_d and an albedo: l_d = 3 D / sqrt(3 (1 - alpha')).
double diffusion_of(double translucency, double albedo) {
  return translucency * std::sqrt(3.0 * (1.0 - albedo)) / 3.0;
}

TEST(CurvatureRatio, KnowsTheRatioOfAFlatSurface) {
  EXPECT_NEAR(ratio_of(1.3).flat_ratio(), 1.45991, 5e-6);  // docs/physics.md
  EXPECT_NEAR(ratio_of(1.4).flat_ratio(), 1.45619, 5e-6);
  EXPECT_NEAR(ratio_of(1.5).flat_ratio(), 1.45401, 5e-6);
  EXPECT_NEAR(ratio_of(1.0).flat_ratio(), 1.5, 1e-9);  // (1/2) / (1/3)
  EXPECT_FALSE(CurvatureRatio::make(0.9));
}

TEST(CurvatureRatio, FindsTheAlbedoThatReflectsAsMuch) {
  const CurvatureRatio model = ratio_of();
  for (const double albedo : {0.0, 0.3, 0.9, 0.99, 0.9999, 1.0})
    EXPECT_NEAR(*model.reduced_albedo(model.diffuse_albedo(albedo)), albedo, 1e-12) << albedo;
  EXPECT_FALSE(model.reduced_albedo(1.2));
  EXPECT_FALSE(model.reduced_albedo(std::nan("")));
}

TEST(CurvatureRatio, GetsTheDiffusionBackThatMadeTheRatio) {
  const CurvatureRatio model = ratio_of();
  double worst = 0.0;
  for (const double albedo : {0.9, 0.95, 0.99, 0.999})
    for (const double translucency : {0.5, 1.0, 2.0, 4.0})
      for (const double radius : {5.0, 10.0, 15.0}) {
        const double diffusion = diffusion_of(translucency, albedo);
        const double ratio = model.ratio(albedo, diffusion / radius);
        if (!std::isfinite(ratio)) continue;  // nothing comes back from so soft a ball
        const double found = *model.bend(albedo, ratio) * radius;
        worst = std::max(worst, std::abs(found / diffusion - 1.0));
      }
  EXPECT_LT(worst, 1e-6);
}

TEST(CurvatureRatio, TheSeriesIsCloseToTheIntegralWhereTheSurfaceBendsLittle) {
  const CurvatureRatio model = ratio_of();
  double worst = 0.0;
  for (const double albedo : {0.9, 0.95, 0.99, 0.999})
    for (const double share : {0.05, 0.1, 0.2, 0.4}) {  // of the radius
      const double bend = diffusion_of(share, albedo);
      const double found = *model.bend(albedo, model.ratio_by_quadrature(albedo, bend));
      worst = std::max(worst, std::abs(found / bend - 1.0));
    }
  EXPECT_LT(worst, 0.08);
}

TEST(CurvatureRatio, TheIntegralIsTheDipolesOwn) {
  // R_c(0) in closed form, (alpha'/(4 pi)) (e^-g + e^-g(1+b)), cancels in r: so a Monte Carlo integral of the cosine over the
  // dipole's profile, by rejection from its own density, answers for the bent one.
  const double albedo = 0.95;
  const double bend = diffusion_of(0.2, albedo);
  const double g = std::sqrt(3.0 * (1.0 - albedo));
  const double reflected = diffusion::internal_moments(kIor).fluence;
  const double b = 4.0 / 3.0 * (1.0 + reflected) / (1.0 - reflected);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kSamples = 400000;
  for (int n = 0; n < kSamples; ++n) {
    const double real = std::exp(-g);
    const double image = std::exp(-g * (1.0 + b));
    const double c = uniform(random) * (real + image) < real ? 3.0 : 3.0 * (1.0 + b);
    // share beyond u of one source's light is c/u e^(-sigma (u - c)): solve it for u
    const double beyond = uniform(random);
    double low = c;
    double high = c / beyond + 1.0;
    for (int step = 0; step < 60; ++step) {
      const double u = 0.5 * (low + high);
      (c / u * std::exp(-g / 3.0 * (u - c)) > beyond ? low : high) = u;
    }
    const double seen = std::cos(bend * std::sqrt(std::max(0.0, low * low - c * c)));
    sum += seen;
    squares += seen * seen;
  }
  const double mean = sum / kSamples;
  const double error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
  const double share = ratio_of().flat_ratio() / ratio_of().ratio_by_quadrature(albedo, bend);
  EXPECT_NEAR(share, mean, 4.0 * error);
  EXPECT_LT(error, 0.01 * (1.0 - mean));
}

TEST(CurvatureRatio, SaysHowMuchAnErrorOfTheRatioWeighs) {
  const CurvatureRatio model = ratio_of();
  const double albedo = 0.98;
  const double ratio = model.ratio(albedo, 0.02);
  const double step = 1e-7;
  const double slope =
      (*model.bend(albedo, ratio + step) - *model.bend(albedo, ratio - step)) / (2.0 * step);
  EXPECT_NEAR(model.bend_per_ratio(albedo, ratio), slope, 1e-5 * slope);
  EXPECT_TRUE(std::isinf(model.bend_per_ratio(albedo, model.flat_ratio())));
}

TEST(CurvatureRatio, RefusesARatioBelowThatOfAFlatSurface) {
  const auto bend = ratio_of().bend(0.9, 1.45);
  ASSERT_FALSE(bend);
  EXPECT_EQ(bend.error().message, "ratio 1.45 is below 1.4562, that of a flat surface");
}

TEST(CurvatureRatio, ShiftedPatternsCarryTheSameRatio) {
  EXPECT_NEAR(shifted_ratio(1.45619), 1.18573, 1e-5);  // docs/physics.md: 1.1857 at 1.4
  EXPECT_DOUBLE_EQ(unshifted_ratio(shifted_ratio(1.7)), 1.7);
}

TEST(CurvatureRatio, ThePrintedFormulasAreFarOff) {
  const CurvatureRatio model = ratio_of();
  const double albedo = 0.98;
  const double diffusion = diffusion_of(1.0, albedo);
  const double curvature = 1.0 / 30.0;
  const double shifted = shifted_ratio(model.ratio(albedo, diffusion * curvature));
  const double reflected = diffusion::internal_moments(kIor).fluence;
  const double a = (1.0 + reflected) / (1.0 - reflected);
  const double printed = as_published::diffusion(albedo, shifted, curvature, a);
  EXPECT_GT(printed / diffusion, 1.2);  // docs/physics.md: 1.2 to 23 times
  EXPECT_LT(printed / diffusion, 30.0);
  const double linear =
      as_published::linear_diffusion(model.diffuse_albedo(albedo), shifted, curvature);
  EXPECT_GT(linear / diffusion, 0.4);
  EXPECT_LT(linear / diffusion, 17.0);
}

}  // namespace
}  // namespace opaline::reconstruct
