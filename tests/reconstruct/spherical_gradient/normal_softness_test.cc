#include "reconstruct/spherical_gradient/normal_softness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/pose.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct {
namespace {

constexpr double kIor = 1.4;
constexpr double kTranslucency = 1.4;
constexpr double kAlbedo = 0.96;
const double kDiffusion = std::sqrt(3.0 * (1.0 - kAlbedo)) * kTranslucency / 3.0;
constexpr int kAcross = 56;
constexpr double kPixel = 0.3;  // mm
constexpr int kEdge = 14;       // pixels: what lies nearer to the border lacks light from beyond it

/// R_d of a flat surface (Jensen et al. 2001), up to a factor.
double dipole(double distance) {
  static const double kBoundary = [] {
    const double inside = diffusion::internal_moments(kIor).fluence;
    return (1.0 + inside) / (1.0 - inside);
  }();
  double sum = 0.0;
  for (const double z : {3.0 * kDiffusion, kDiffusion * (3.0 + 4.0 * kBoundary)}) {
    const double d = std::hypot(distance, z);
    sum += z * (1.0 + d / kTranslucency) * std::exp(-d / kTranslucency) / (d * d * d);
  }
  return sum;
}

using Height = std::function<double(double x, double y)>;

double place(int n) { return (n + 0.5 - 0.5 * kAcross) * kPixel; }

Vec3 true_normal(const Height& z, double x, double y) {
  constexpr double h = 1e-4;
  return normalized(
      {(z(x - h, y) - z(x + h, y)) / (2.0 * h), (z(x, y - h) - z(x, y + h)) / (2.0 * h), 1.0});
}

/// What a dipole makes of a surface under gradient light, by a sum over it: each place's vector is the mean of the normals around, weighed by R_d and area.
ScatteringMaps soft_maps(const Height& z) {
  std::vector<Vec3> points;
  std::vector<Vec3> normals;
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x) {
      points.push_back({place(x), place(y), z(place(x), place(y))});
      normals.push_back(true_normal(z, place(x), place(y)));
    }
  ScatteringMaps maps;
  maps.width = maps.height = kAcross;
  std::vector<Vec3> soft;
  for (std::size_t at = 0; at < points.size(); ++at) {
    Vec3 sum;
    for (std::size_t from = 0; from < points.size(); ++from) {
      const double weight = dipole(length(points[from] - points[at])) / normals[from].z;
      sum = sum + normals[from] * weight;
    }
    soft.push_back(normalized(sum));
  }
  const auto at = [&](int x, int y) {
    return soft[static_cast<std::size_t>(std::clamp(y, 0, kAcross - 1) * kAcross +
                                         std::clamp(x, 0, kAcross - 1))];
  };
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x) {
      maps.normal_x.push_back(static_cast<float>(at(x, y).x));
      maps.normal_y.push_back(static_cast<float>(at(x, y).y));
      maps.normal_z.push_back(static_cast<float>(at(x, y).z));
      maps.curvature_deviation.push_back(1e-4F);
      maps.curvature.push_back(static_cast<float>(
          0.25 * (at(x + 1, y).x - at(x - 1, y).x + at(x, y + 1).y - at(x, y - 1).y) / kPixel));
    }
  maps.translucency.assign(soft.size(), static_cast<float>(kTranslucency));
  maps.diffusion.assign(soft.size(), static_cast<float>(kDiffusion));
  maps.left_out.assign(soft.size(), LeftOut::kFound);
  return maps;
}

double mean_degrees(const ScatteringMaps& maps, const Height& z) {
  double sum = 0.0;
  int count = 0;
  for (int y = kEdge; y < kAcross - kEdge; ++y)
    for (int x = kEdge; x < kAcross - kEdge; ++x) {
      const auto at = static_cast<std::size_t>(y * kAcross + x);
      const double cosine = dot(true_normal(z, place(x), place(y)),
                                {maps.normal_x[at], maps.normal_y[at], maps.normal_z[at]});
      sum += std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi;
      ++count;
    }
  return sum / count;
}

void sharpen(ScatteringMaps& maps) {
  GradientPictures pictures;
  pictures.pixel_mm = kPixel;
  ThreadTeam team(2);
  sharpen_normals(pictures, kIor, team, maps);
}

double ball(double x, double y) { return std::sqrt(400.0 - x * x - y * y); }

TEST(NormalSoftness, SpreadIsTheDipolesSecondMoment) {
  double light = 0.0;
  double squares = 0.0;
  constexpr double kStep = 0.002;
  for (double r = 0.5 * kStep; r < 40.0; r += kStep) {
    const double ring = r * dipole(r);
    light += ring;
    squares += ring * r * r;
  }
  EXPECT_NEAR(spread_along_axis(kTranslucency, kDiffusion, kIor),
              0.5 * squares / light,
              2e-3 * squares / light);
}

TEST(NormalSoftness, ABallsNormalsStayAsTheyAre) {
  ScatteringMaps maps = soft_maps(ball);
  const ScatteringMaps before = maps;
  sharpen(maps);
  double most = 0.0;
  for (int y = kEdge; y < kAcross - kEdge; ++y)
    for (int x = kEdge; x < kAcross - kEdge; ++x) {
      const auto at = static_cast<std::size_t>(y * kAcross + x);
      most = std::max<double>(most, std::abs(maps.normal_x[at] - before.normal_x[at]));
    }
  EXPECT_LT(most * 180.0 / std::numbers::pi, 0.1);
}

TEST(NormalSoftness, TakesMostOfWhatDipolesMakeOfABumpAway) {
  const Height bump = [](double x, double y) {
    return ball(x, y) + 0.8 * std::exp(-(x * x + y * y) / (2.0 * 2.4 * 2.4));
  };
  ScatteringMaps maps = soft_maps(bump);
  const double before = mean_degrees(maps, bump);
  sharpen(maps);
  EXPECT_GT(before, 1.0);
  EXPECT_LT(mean_degrees(maps, bump), 0.5 * before);
}

TEST(NormalSoftness, WithoutAnyAnswerNothingIsKnownOfTheLightsReach) {
  ScatteringMaps maps = soft_maps(ball);
  maps.left_out.assign(maps.left_out.size(), LeftOut::kBelowNoise);
  const ScatteringMaps before = maps;
  sharpen(maps);
  EXPECT_EQ(maps.normal_x, before.normal_x);
}

}  // namespace
}  // namespace opaline::reconstruct
