#include "reconstruct/diffusion/boundary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct::diffusion {
namespace {

double a_of(BoundaryModel model, double ior) { return make_boundary(model, ior)->a; }

// Midpoint rule in the inside cosine, with the kink at the critical angle smeared over one step of
// 1e-6.
template <class Function>
double midpoint(const Function& f) {
  constexpr int kSteps = 1'000'000;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) sum += f((i + 0.5) / kSteps);
  return sum / kSteps;
}

TEST(Fresnel, IsTotalBeyondTheCriticalAngleAndReciprocalWithinIt) {
  EXPECT_EQ(fresnel_reflectance(0.6, 1.0 / 1.3), 1.0);
  for (const double outside : {0.05, 0.4, 0.9, 1.0}) {
    EXPECT_NEAR(fresnel_reflectance(outside, 1.3),
                fresnel_reflectance(refracted_cosine(outside, 1.3), 1.0 / 1.3),
                1e-13);
  }
  EXPECT_NEAR(fresnel_reflectance(1.0, 1.5), 0.04, 1e-15);
  EXPECT_NEAR(fresnel_reflectance(0.3, 1.0), 0.0, 1e-15);
}

TEST(Fresnel, MomentsAgreeWithAnotherQuadratureInAnotherVariable) {
  for (const double ior : {1.0, 1.001, 1.3, 1.5, 3.0}) {
    const FresnelMoments moments = internal_moments(ior);
    const auto r = [ior](double mu) { return fresnel_reflectance(mu, 1.0 / ior); };
    EXPECT_NEAR(moments.fluence, midpoint([&](double mu) { return 2.0 * r(mu) * mu; }), 1e-8);
    EXPECT_NEAR(moments.flux, midpoint([&](double mu) { return 3.0 * r(mu) * mu * mu; }), 1e-8);
  }
}

// The numbers of docs/physics.md, to their last digit.
TEST(Boundary, HasTheKnownConstantsAtIndex1_3) {
  EXPECT_NEAR(a_of(BoundaryModel::kTwoMoment, 1.3), 2.34053, 5e-6);
  EXPECT_NEAR(a_of(BoundaryModel::kJensen, 1.3), 2.60008, 5e-6);
  EXPECT_NEAR(a_of(BoundaryModel::kKeijzer, 1.3), 2.18939, 5e-6);
  EXPECT_NEAR(internal_moments(1.3).fluence, 0.444457, 5e-7);
  EXPECT_NEAR(make_boundary(BoundaryModel::kJensen, 1.3)->source_scale, 7.2, 0.005);
}

TEST(Boundary, IsTransparentWithoutAnIndexStep) {
  for (const auto model :
       {BoundaryModel::kTwoMoment, BoundaryModel::kJensen, BoundaryModel::kKeijzer}) {
    EXPECT_NEAR(a_of(model, 1.0), 1.0, 1e-12) << to_string(model);
  }
}

/// The share that a half-space reflects of diffuse light at a matched index, without anisotropy: 1 + J_n / q of
/// phi = S e^(-z / l), S = 4 q.
double half_space_albedo(BoundaryModel model, double s) {
  const double rate = s / std::sqrt(3.0);  // kappa / l with s^2 = sigma_a l*
  return 1.0 - 4.0 * rate / (1.0 + 2.0 * a_of(model, 1.0) * rate);
}

// Van de Hulst's fit to the exact spherical albedo (Multiple light scattering, 1980, isotropic scattering).
TEST(Boundary, MilnesHalfSpaceReflectsWhatTransportSays) {
  for (const double s : {0.05, 0.1, 0.2}) {
    const double exact = (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s);
    const double milne = std::abs(half_space_albedo(BoundaryModel::kMilne, s) - exact);
    const double marshak = std::abs(half_space_albedo(BoundaryModel::kTwoMoment, s) - exact);
    EXPECT_LT(milne, 0.25 * marshak) << s;
    EXPECT_LT(milne, 1e-3) << s;
  }
}

TEST(Boundary, RefusesAnIndexOutOfRange) {
  for (const double ior : {0.99, 3.01, std::nan("")}) {
    const auto boundary = make_boundary(BoundaryModel::kTwoMoment, ior);
    ASSERT_FALSE(boundary);
    EXPECT_EQ(boundary.error().code, ErrorCode::kInvalidArgument);
  }
}

// M = int L mu dw = 2 pi int L mu dmu, for an unlit face, exactly when A has both moments.
TEST(CameraEquation, IntegratesOverTheHemisphereToTheExitance) {
  for (const double ior : {1.0, 1.3, 2.0}) {
    const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, ior);
    const double exitance = midpoint([&](double mu) {
      return 2.0 * std::numbers::pi * mu * camera_equation(ior, boundary, mu).radiance(0.0, 1.0);
    });
    EXPECT_NEAR(exitance, 1.0, 1e-8) << ior;
  }
}

// On a lit face S adds what is reflected inside: M = q + J_n again.
TEST(CameraEquation, IntegratesToTheExitanceOnALitFaceToo) {
  const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, 1.3);
  const double q = 0.7;
  const double net_flux = -0.2;
  const double exitance = midpoint([&](double mu) {
    return 2.0 * std::numbers::pi * mu *
           camera_equation(1.3, boundary, mu).radiance(boundary.source_scale * q, net_flux);
  });
  EXPECT_NEAR(exitance, q + net_flux, 1e-8);
}

}  // namespace
}  // namespace opaline::reconstruct::diffusion
