#include "reconstruct/spherical_gradient/pixel_ratio.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kDraws = 40'000;
constexpr double kConstant = 1.0;
constexpr double kLength = 0.6;  // of the gradients' vector: r = 1 / 0.6
constexpr double kNoise =
    0.01;  // of a picture of radiance 1; its variance is in proportion to the light

/// One normal, photographed again and again.
GradientPictures pictures_of(const std::array<double, 3>& normal) {
  GradientPictures p;
  p.width = static_cast<int>(kDraws);
  p.height = 1;
  p.measured.assign(kDraws, kMeasured);
  std::mt19937 random(3);
  for (std::size_t picture = 0; picture < 4; ++picture) {
    const double clean =
        picture == 0 ? kConstant : 0.5 * (kConstant + kLength * normal[picture - 1]);
    std::normal_distribution<double> radiance(clean, kNoise * std::sqrt(clean));
    for (std::size_t n = 0; n < kDraws; ++n) {
      p.radiance[picture].push_back(static_cast<float>(radiance(random)));
      p.variance[picture].push_back(static_cast<float>(kNoise * kNoise * clean));
    }
  }
  return p;
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};
Moments moments(const std::vector<float>& values) {
  Moments m;
  for (const float v : values) m.mean += v / static_cast<double>(values.size());
  for (const float v : values)
    m.variance += (v - m.mean) * (v - m.mean) / static_cast<double>(values.size());
  return m;
}

class PixelRatio : public ::testing::TestWithParam<std::array<double, 3>> {};

// Of forty thousand draws: a variance to 0.7 %, of which four; and to second order in the noise, 1e-3.
TEST_P(PixelRatio, StatesTheNoiseOfNormalAndRatio) {
  const GradientPictures pictures = pictures_of(GetParam());
  ThreadTeam team(1);
  PixelValues values(pictures.width, 1, team);
  ScatteringMaps maps;
  for (auto* map : {&maps.normal_x, &maps.normal_y, &maps.normal_z}) map->assign(kDraws, 0.0F);
  maps.left_out.assign(kDraws, LeftOut::kNotMeasured);
  for (std::size_t at = 0; at < kDraws; ++at) measure_pixel(pictures, at, values, maps);
  const Moments x = moments(values.normal_x);
  const Moments y = moments(values.normal_y);
  const double drawn = 0.5 * (x.variance + y.variance);
  EXPECT_NEAR(x.mean, GetParam()[0], 0.001);
  EXPECT_NEAR(y.mean, GetParam()[1], 0.001);
  EXPECT_NEAR(moments(values.normal_variance).mean, drawn, 0.03 * drawn);
  const Moments ratio = moments(values.ratio);
  EXPECT_NEAR(ratio.mean, kConstant / kLength, 0.002);
  EXPECT_NEAR(moments(values.ratio_variance).mean, ratio.variance, 0.03 * ratio.variance);
}

INSTANTIATE_TEST_SUITE_P(Normals,
                         PixelRatio,
                         ::testing::Values(std::array{0.0, 0.0, 1.0},
                                           std::array{0.6, 0.0, 0.8},
                                           std::array{-0.48, 0.64, 0.6},
                                           std::array{0.64, -0.6, 0.48}));

}  // namespace
}  // namespace opaline::reconstruct
