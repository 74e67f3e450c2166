#include "render/dipole/mesh_texels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

constexpr double kRadius = 8.0;
constexpr std::size_t kMiddleRow = std::size_t{32} * 65;  // of view_turned()

/// A ball with longitude and latitude as its coordinates, its seam behind.
TexturedMesh ball() {
  constexpr int kAround = 96;
  constexpr int kUp = 48;
  TexturedMesh mesh;
  for (int j = 0; j <= kUp; ++j)
    for (int i = 0; i <= kAround; ++i) {
      const double turn = 2.0 * pi * (static_cast<double>(i) / kAround - 0.5);
      const double rise = pi * (static_cast<double>(j) / kUp - 0.5);
      const Vec3 normal{
          std::cos(rise) * std::sin(turn), std::sin(rise), std::cos(rise) * std::cos(turn)};
      mesh.corners.push_back({normal * kRadius,
                              normal,
                              static_cast<double>(i) / kAround,
                              static_cast<double>(j) / kUp});
    }
  const auto corner = [](int i, int j) {
    return static_cast<std::uint32_t>(j * (kAround + 1) + i);
  };
  for (int j = 0; j < kUp; ++j)
    for (int i = 0; i < kAround; ++i) {
      mesh.triangles.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      mesh.triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  return mesh;
}

DipoleTexture even(float albedo, float diffusion) { return {1, 1, {albedo}, {diffusion}}; }

ParallelView view_turned(double turn) {
  ParallelView view;
  view.view_from_mesh.rotation = {
      std::cos(turn), 0.0, std::sin(turn), 0.0, 1.0, 0.0, -std::sin(turn), 0.0, std::cos(turn)};
  view.width = view.height = 65;
  view.pixel_mm = 0.26;
  return view;
}

std::vector<float> exitance(const TexelSurface& surface, const LinearLight& light) {
  ThreadTeam team(2);
  const auto found = diffuse_texels(surface, light, 1.4, team);
  EXPECT_TRUE(found);
  return *found;
}

// Two rasters of one ball: 0.26 mm squares of a picture, and up to 0.52 mm of a map of the world. l_d is 0.9 mm, so that what a picture's pixels in the middle half do not
// see is beyond the kernel's reach. 3 %: sums over texels half as large as the real source's depth 3 D err by some percent (texture_diffusion_test.cc).
TEST(MeshTexels, ScreenSpaceAndTextureSpaceSeeTheSameBall) {
  const TexturedMesh mesh = ball();
  const DipoleTexture texture = even(0.9F, 0.165F);
  const LinearLight light{0.5, {0.3, 0.0, 0.4}};
  const TexelSurface world = *texels_of_texture(mesh, texture, 192, 96);
  const TexelSurface seen = *texels_of_view(mesh, texture, view_turned(0.0));
  const auto of_world = exitance(world, light);
  const auto of_view = exitance(seen, light);
  for (const int x : {24, 28, 32, 36, 40}) {
    const std::size_t at = kMiddleRow + static_cast<std::size_t>(x);
    ASSERT_EQ(seen.covered[at], 1);
    const double turn = std::atan2(seen.position[at].x, seen.position[at].z);
    const auto there = static_cast<std::size_t>(192.0 * (turn / (2.0 * pi) + 0.5));
    EXPECT_NEAR(of_view[at] / of_world[std::size_t{48} * 192 + there], 1.0, 0.03) << x;
  }
}

TEST(MeshTexels, ABallLooksTheSameFromEverySide) {
  const TexturedMesh mesh = ball();
  const DipoleTexture texture = even(0.9F, 0.165F);
  const auto front = exitance(*texels_of_view(mesh, texture, view_turned(0.0)), {1.0, {}});
  const auto side = exitance(*texels_of_view(mesh, texture, view_turned(1.2)), {1.0, {}});
  EXPECT_NEAR(side[kMiddleRow + 32] / front[kMiddleRow + 32], 1.0, 0.01);
}

TEST(MeshTexels, TheNearerSurfaceHidesTheOneBehind) {
  const TexelSurface seen = *texels_of_view(ball(), even(0.9F, 0.165F), view_turned(0.5));
  for (std::size_t at = 0; at < seen.covered.size(); ++at)
    if (seen.covered[at] != 0) {
      EXPECT_GE(seen.position[at].z, -0.1);
    }
}

TEST(MeshTexels, ATexturesTexelsTogetherAreTheSurface) {
  const TexelSurface world = *texels_of_texture(ball(), even(0.9F, 0.165F), 192, 96);
  double area = 0.0;
  for (const float texel : world.area) area += texel;
  EXPECT_NEAR(area / (4.0 * pi * kRadius * kRadius), 1.0, 0.01);
}

TEST(TexturedObj, ReadsCornersWithTheirCoordinates) {
  const auto mesh = decode_textured_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2/7 3/3 -1/-1\n",
      25.4);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->triangles.size(), 2U);
  EXPECT_EQ(mesh->corners[1].position.x, 25.4);
  EXPECT_EQ(mesh->corners[3].v, 1.0);
  EXPECT_NEAR(mesh->corners[0].normal.z, 1.0, 1e-12);
}

TEST(TexturedObj, NamesTheLineThatIsWrong) {
  EXPECT_THAT(decode_textured_obj("v 0 0 x\n").error().message, HasSubstr("line 1"));
  EXPECT_THAT(decode_textured_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").error().message,
              HasSubstr("line 4: a corner \"1\"; expected vertex/coordinate"));
  EXPECT_THAT(decode_textured_obj("vt 0 0\nv 0 0 0\nf 1/1 2/1 1/1\n").error().message,
              HasSubstr("line 3"));
  EXPECT_THAT(decode_textured_obj("# nothing\n").error().message, HasSubstr("no faces"));
}

}  // namespace
}  // namespace opaline::render
