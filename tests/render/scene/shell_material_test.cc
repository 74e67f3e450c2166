#include "render/scene/shell_material.h"

#include <gmock/gmock.h>

#include <cmath>

#include "render/mesh/shapes.h"
#include "render/mesh/turn.h"

namespace opaline::render {
namespace {

constexpr double kCell = 0.5;  // mm

/// A block of n x n x layers cells whose absorption is told by cell.
template <class Absorption>
std::shared_ptr<Material> block_of(int n, int layers, const Absorption& absorption) {
  auto material = std::make_shared<Material>();
  material->block = {n, n, layers, kCell, kCell, kCell};
  for (auto& channel : material->channels) {
    channel.reduced_scattering.assign(material->block.cell_count(), 1.0);
    for (int k = 0; k < layers; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) channel.absorption.push_back(absorption(i, j, k));
      }
    }
  }
  return material;
}

ShellMaterial shell_of(const std::shared_ptr<Material>& block,
                       const SignedDistance& solid,
                       const ShellOptions& options = {},
                       const Pose& pose = {}) {
  auto shell = ShellMaterial::create(block, options, solid, pose, {});
  EXPECT_TRUE(shell) << shell.error().message;
  return *std::move(shell);
}

// Four layers of 0.5 mm, the outermost (z_max) 0.4: a place at the middle of a layer has the layer's value, whichever way
// the surface faces. The torus' distance is exact, so what is left is rounding.
TEST(ShellMaterial, FollowsTheSurfaceWithDepth) {
  const auto torus = *make_shape("torus", 20.0);
  const auto block = block_of(3, 4, [](int, int, int k) { return 0.1 * (k + 1); });
  const ShellMaterial shell = shell_of(block, *torus);
  EXPECT_EQ(shell.depth_mm(), 2.0);
  for (const double angle : {0.1, 1.0, 2.5, 4.0}) {
    for (const double around : {0.3, 1.7, 3.0, 5.0}) {
      for (int layer = 0; layer < 4; ++layer) {
        const double r = 2.5 - kCell * (layer + 0.5);
        const double ring = 7.5 + r * std::cos(around);
        const Vec3 p{ring * std::cos(angle), ring * std::sin(angle), r * std::sin(around)};
        ASSERT_NEAR(-torus->at(p), kCell * (layer + 0.5), 1e-9);
        EXPECT_NEAR(shell.at(p).absorption[1], 0.1 * (4 - layer), 1e-6) << angle << ' ' << around;
      }
    }
  }
}

TEST(ShellMaterial, LiesAlongTheSurfaceInMillimetresTimesItsScale) {
  const auto sphere = *make_shape("sphere", 20.0);
  const auto stripes = block_of(8, 2, [](int i, int, int) { return i % 2 == 0 ? 0.1 : 0.5; });
  const ShellMaterial shell = shell_of(stripes, *sphere, {.scale = 2.0});
  // On top the normal is z, so the block lies along x and y: stripes of 1 mm, their middles at 0.5, 1.5 ...
  EXPECT_NEAR(shell.at({0.5, 0.3, 9.9}).absorption[0], 0.1, 0.01);
  EXPECT_NEAR(shell.at({1.5, 0.3, 9.8}).absorption[0], 0.5, 0.03);
  const ShellMaterial moved = shell_of(stripes, *sphere, {.scale = 2.0, .origin = {1.0, 0.0, 0.0}});
  EXPECT_NEAR(moved.at({1.5, 0.3, 9.8}).absorption[0], 0.1, 0.03);
}

TEST(ShellMaterial, TurnsWithItsShape) {
  const auto sphere = *make_shape("sphere", 20.0);
  const auto stripes = block_of(8, 2, [](int i, int, int) { return i % 2 == 0 ? 0.1 : 0.5; });
  const Pose turn = turned_about_axes({30.0, 50.0, -20.0});
  const ShellMaterial still = shell_of(stripes, *sphere);
  const ShellMaterial turned = shell_of(stripes, *sphere, {}, turn);
  for (const Vec3 p : {Vec3{1.0, 2.0, 9.3}, {5.0, -6.0, 5.5}, {-9.1, 1.0, 3.0}}) {
    EXPECT_NEAR(turned.at(turn.apply(p)).absorption[0], still.at(p).absorption[0], 1e-6);
  }
}

TEST(ShellMaterial, ItsCoreIsInterpolatedFromTheShellsInnerBoundary) {
  const auto sphere = *make_shape("sphere", 20.0);
  const auto even = block_of(3, 4, [](int, int, int k) { return 0.1 * (k + 1); });
  const ShellMaterial plain = shell_of(even, *sphere);
  EXPECT_GT(plain.core_samples(), 500U);
  EXPECT_NEAR(
      plain.at({0.0, 0.0, 0.0}).absorption[0], 0.1, 1e-6);  // all the boundary is the last layer
  EXPECT_NEAR(plain.at({3.0, -2.0, 4.0}).absorption[0], 0.1, 1e-6);
  // Along z from the middle of the top to the middle of the sphere, over a block whose halves differ: the core goes from what is
  // above it to the mean of all, and never beyond what the boundary has.
  const auto halves = block_of(40, 2, [](int i, int, int) { return i < 20 ? 0.1 : 0.5; });
  const ShellMaterial mixed =
      shell_of(halves, *sphere, {.origin = {-10.0, -10.0, -10.0}, .tiling = Tiling::kClamp});
  double before = mixed.at({3.0, 0.0, 8.9}).absorption[0];
  EXPECT_NEAR(before, 0.5, 0.02);
  for (double z = 8.8; z > 0.0; z -= 0.1) {
    const double now = mixed.at({3.0, 0.0, z}).absorption[0];
    EXPECT_NEAR(now, before, 0.05) << z;  // no step where shell goes over into core
    EXPECT_GE(now, 0.1);
    EXPECT_LE(now, 0.5);
    before = now;
  }
  EXPECT_GT(before, 0.15);
  EXPECT_LT(before, 0.45);
}

TEST(ShellMaterial, IsAllThereIsWhereTheSolidIsThin) {
  const auto sheet = *make_shape("sheet", 20.0);
  const auto block = block_of(3, 40, [](int, int, int k) { return k == 39 ? 0.5 : 0.1; });
  const ShellMaterial shell = shell_of(block, *sheet);
  EXPECT_EQ(shell.core_samples(), 0U);
  const Box box = sheet->bounds();
  EXPECT_NEAR(shell.at({0.0, 0.0, box.high.z}).absorption[0], 0.5, 0.05);
}

TEST(ShellMaterial, RefusesLengthsThatAreNone) {
  const auto sphere = *make_shape("sphere", 20.0);
  const auto block = block_of(3, 4, [](int, int, int) { return 0.1; });
  EXPECT_FALSE(ShellMaterial::create(block, {.scale = 0.0}, *sphere, {}, {}));
  EXPECT_FALSE(ShellMaterial::create(block, {.depth_mm = -1.0}, *sphere, {}, {}));
}

}  // namespace
}  // namespace opaline::render
