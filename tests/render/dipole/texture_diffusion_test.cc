#include "render/dipole/texture_diffusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

/// A flat square of one material, sampled every `texel` mm.
TexelSurface flat(int texels, double texel, double albedo, double diffusion) {
  TexelSurface s{.width = texels, .height = texels, .texel_mm = texel};
  for (int y = 0; y < texels; ++y)
    for (int x = 0; x < texels; ++x) {
      s.position.push_back({x * texel, y * texel, 0.0});
      s.normal.push_back({0.0, 0.0, 1.0});
      s.area.push_back(static_cast<float>(texel * texel));
      s.covered.push_back(1);
      s.reduced_albedo.push_back(static_cast<float>(albedo));
      s.diffusion.push_back(static_cast<float>(diffusion));
    }
  return s;
}

double middle(const TexelSurface& s, const LinearLight& light, double ior) {
  ThreadTeam team(2);
  const auto exitance = diffuse_texels(s, light, ior, team);
  EXPECT_TRUE(exitance);
  return (*exitance)[static_cast<std::size_t>(s.height / 2 * s.width + s.width / 2)];
}

// Closed form at a matched index, A = 1: M = pi L R_d, R_d = alpha'/2 (1 + e^(-4/3 g)) e^(-g) (Jensen et al. 2001, eq. for the diffuse reflectance). The texels
// are a third of the real source's depth 3 D, and the sum by their centres errs by its square; the square ends 9 l_d away, the kernel after 8.
TEST(TextureDiffusion, SumsToTheDiffuseAlbedoOfAPlane) {
  const double albedo = 0.7;
  const double diffusion = 0.1;
  const double g = std::sqrt(3.0 * (1.0 - albedo));
  const double expected =
      std::numbers::pi * 0.5 * albedo * (1.0 + std::exp(-4.0 / 3.0 * g)) * std::exp(-g);
  const TexelSurface s = flat(61, 0.1, albedo, diffusion);
  EXPECT_NEAR(middle(s, {1.0, {}}, 1.0) / expected, 1.0, 0.02);
}

// int mu dmu = 1/2 and int mu^2 dmu = 1/3 at a matched index: a gradient along the normal makes two thirds of what constant light does.
TEST(TextureDiffusion, TakesTwoThirdsOfAGradientAlongTheNormal) {
  const TexelSurface s = flat(41, 0.2, 0.9, 0.1);
  const double constant = middle(s, {1.0, {}}, 1.0);
  EXPECT_NEAR(middle(s, {0.0, {0.0, 0.0, 1.0}}, 1.0) / constant, 2.0 / 3.0, 1e-5);
  EXPECT_NEAR(middle(s, {1.0, {1.0, 0.0, 0.0}}, 1.0) / constant, 1.0, 1e-6);
}

TEST(TextureDiffusion, BleedsOverAnEdgeOfLight) {
  TexelSurface s = flat(61, 0.1, 0.98, 0.1);
  for (std::size_t at = 0; at < s.normal.size(); ++at)
    if (s.position[at].x > 3.05) s.normal[at] = {0.0, 0.0, -1.0};  // dark under this light
  ThreadTeam team(2);
  const auto exitance = *diffuse_texels(s, {0.5, {0.0, 0.0, 1.0}}, 1.4, team);
  const auto at = [&](int x) { return exitance[static_cast<std::size_t>(30 * 61 + x)]; };
  EXPECT_GT(at(33), 0.05F * at(5));
  EXPECT_GT(at(33), at(40));
  EXPECT_GT(at(40), at(55));
}

TEST(TextureDiffusion, RefusesMapsThatDoNotFit) {
  ThreadTeam team(1);
  TexelSurface s = flat(4, 0.1, 0.9, 0.1);
  s.area.pop_back();
  EXPECT_FALSE(diffuse_texels(s, {}, 1.4, team));
  s = flat(4, 0.1, 0.9, 0.0);
  EXPECT_FALSE(diffuse_texels(s, {}, 1.4, team));
}

}  // namespace
}  // namespace opaline::render
