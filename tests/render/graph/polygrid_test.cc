#include "render/graph/polygrid.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/graph/two_point.h"
#include "render/mesh/shapes.h"
#include "render/solver/lane_solver.h"
#include "tests/render/graph/lit_sphere.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::BoundaryModel;
using reconstruct::diffusion::make_boundary;
using reconstruct::diffusion::Termination;
using ::testing::HasSubstr;

Polygrid grid_of(std::string_view shape, double spacing, double growth = 0.0) {
  const auto solid = make_shape(shape, 20.0);
  auto grid = make_polygrid(**solid, spacing, growth, {});
  EXPECT_TRUE(grid);
  return *std::move(grid);
}

/// Relative RMS error of the surface's fluence on the lit sphere of 10 mm.
double sphere_error(double spacing, double growth = 0.0) {
  constexpr double kAbsorption = 0.01;
  const auto boundary = *make_boundary(BoundaryModel::kTwoMoment, 1.3);
  Optics optics;
  optics.absorption.fill(kAbsorption);
  optics.diffusion.fill(1.0 / (3.0 * (1.0 + kAbsorption)));
  const Polygrid grid = grid_of("sphere", spacing, growth);
  TwoPoint<double, Polygrid> diffusion(grid, boundary);
  EXPECT_TRUE(diffusion.set_material(std::vector(grid.inner.size(), optics)));
  std::vector<std::array<float, 3>> q(grid.surface.size());
  for (std::size_t s = 0; s < q.size(); ++s) {
    q[s].fill(static_cast<float>(LitSphere::irradiance(grid.surface[s].place)));
  }
  std::vector<Lanes<double>> b;
  diffusion.load(q, b);
  ThreadTeam team(1);
  std::vector<Lanes<double>> phi(b.size(), Lanes<double>::zero());
  LaneSolver<double> solver(diffusion.matrix(), {}, team);
  EXPECT_EQ(solver.solve(b, phi, {.tolerance = 1e-8}, {}).termination, Termination::kConverged);
  const SurfaceLight light = diffusion.surface_light(q, phi);
  const LitSphere exact(10.0, optics.diffusion[0], kAbsorption, boundary);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t s = 0; s < q.size(); ++s) {
    const double truth = exact.fluence(grid.surface[s].place);
    error += grid.surface[s].area * std::pow(light.fluence[s][0] - truth, 2);
    size += grid.surface[s].area * truth * truth;
  }
  return std::sqrt(error / size);
}

// The bounds are the figures of docs/physics.md for a polygrid with the condition along the true normal.
TEST(Polygrid, ALitSphereConvergesToTheExactSolution) {
  const double coarse = sphere_error(1.25);
  const double fine = sphere_error(0.8);
  EXPECT_LE(coarse, 0.025);
  EXPECT_LE(fine, 0.016);
  EXPECT_LT(fine, 0.8 * coarse);
  EXPECT_LT(sphere_error(0.5), 0.8 * fine);
}

/// w_j = W_2j + W_4j + W_6j of Wang 2008, appendix B, W the inverse of the rows (dx_j, dx_j^2/2, dy_j, dy_j^2/2, dz_j, dz_j^2/2):
/// what makes sum_j w_j (f_j - f_0) the Laplacian of f = x^2/2, y^2/2 and z^2/2, and 0 for x, y and z.
std::array<double, 6> appendix_b_weights(const std::array<Vec3, 6>& offsets) {
  std::array<std::array<double, 7>, 6> rows{};  // W^T w = (0, 1, 0, 1, 0, 1)
  for (int j = 0; j < 6; ++j) {
    const Vec3 d = offsets[j];
    const std::array<double, 6> terms{
        d.x, 0.5 * d.x * d.x, d.y, 0.5 * d.y * d.y, d.z, 0.5 * d.z * d.z};
    for (int m = 0; m < 6; ++m) rows[m][j] = terms[m];
  }
  for (int m = 0; m < 6; ++m) rows[m][6] = m % 2;
  for (int k = 0; k < 6; ++k) {
    const auto most = std::max_element(rows.begin() + k, rows.end(), [k](auto& a, auto& b) {
      return std::abs(a[k]) < std::abs(b[k]);
    });
    std::iter_swap(rows.begin() + k, most);
    for (int m = 0; m < 6; ++m) {
      const double factor = m == k ? 0.0 : rows[m][k] / rows[k][k];
      for (int c = k; c < 7; ++c) rows[m][c] -= factor * rows[k][c];
    }
  }
  std::array<double, 6> weights{};
  for (int k = 0; k < 6; ++k) weights[k] = rows[k][6] / rows[k][k];
  return weights;
}

TEST(Polygrid, InsideItsWeightsAreThoseOfWang2008AppendixB) {
  const Polygrid grid = grid_of("torus", 0.5);
  int inside = 0;
  for (std::size_t i = 0; i < grid.inner.size(); ++i) {
    const auto& links = grid.links[i];
    if (links.size() != 6 || std::ranges::any_of(links, [](auto& l) { return l.inner < 0; }))
      continue;
    std::array<Vec3, 6> offsets;
    for (int k = 0; k < 6; ++k) offsets[k] = grid.inner[links[k].inner] - grid.inner[i];
    const auto weights = appendix_b_weights(offsets);
    for (int k = 0; k < 6; ++k) {
      const double own = links[k].area / links[k].length / grid.volumes[i];
      ASSERT_NEAR(own, weights[k], 1e-9 * weights[k]);
    }
    ++inside;
  }
  EXPECT_GT(inside, 1000);
}

TEST(Polygrid, BoundaryNodesLieOnTheSurfaceAndCoverIt) {
  const Polygrid grid = grid_of("torus", 0.3);
  const auto torus = make_shape("torus", 20.0);
  double area = 0.0;
  for (const auto& node : grid.surface) {
    EXPECT_NEAR((*torus)->at(node.place), 0.0, 1e-3);
    area += node.area;
  }
  EXPECT_NEAR(area / (4.0 * std::numbers::pi * std::numbers::pi * 7.5 * 2.5), 1.0, 0.06);
  double volume = 0.0;
  for (const double v : grid.volumes) volume += v;
  EXPECT_NEAR(volume / (2.0 * std::numbers::pi * std::numbers::pi * 7.5 * 2.5 * 2.5), 1.0, 0.02);
}

class Cuboid final : public SignedDistance {
 public:
  Cuboid(Vec3 half, double turn) : half_(half), cos_(std::cos(turn)), sin_(std::sin(turn)) {}
  double at(Vec3 p) const override {
    const Vec3 d{std::abs(cos_ * p.x + sin_ * p.y) - half_.x,
                 std::abs(cos_ * p.y - sin_ * p.x) - half_.y,
                 std::abs(p.z) - half_.z};
    const Vec3 out{std::max(d.x, 0.0), std::max(d.y, 0.0), std::max(d.z, 0.0)};
    return length(out) + std::min(0.0, std::max({d.x, d.y, d.z}));
  }
  Box bounds() const override {
    const double reach = std::hypot(half_.x, half_.y);
    return {{-reach, -reach, -half_.z}, {reach, reach, half_.z}};
  }

 private:
  Vec3 half_;
  double cos_;
  double sin_;
};

double surface_area(const SignedDistance& solid, double spacing) {
  const auto grid = make_polygrid(solid, spacing, 0.0, {});
  EXPECT_TRUE(grid);
  double area = 0.0;
  for (const auto& node : grid->surface) {
    EXPECT_NEAR(solid.at(node.place), 0.0, 0.3 * spacing);
    area += node.area;
  }
  return area;
}

TEST(Polygrid, ACubesEdgesAndCornersBelongToEachOfTheirSides) {
  EXPECT_NEAR(surface_area(Cuboid({4.0, 4.0, 4.0}, 0.0), 0.5), 6.0 * 64.0, 1e-6);
  EXPECT_NEAR(surface_area(Cuboid({4.0, 4.0, 4.0}, 0.4), 0.25), 6.0 * 64.0, 0.02 * 6.0 * 64.0);
}

TEST(Polygrid, ASlantedSheetOfOneOrTwoNodesHasBothOfItsSides) {
  const double area = 8.0 * (8.0 * 8.0 + 2.0 * 8.0 * 0.35);
  EXPECT_NEAR(surface_area(Cuboid({8.0, 0.35, 8.0}, 0.4), 0.5), area, 0.05 * area);
}

TEST(Polygrid, LinksGoBothWays) {
  const Polygrid grid = grid_of("figurine", 1.0);
  for (std::size_t i = 0; i < grid.links.size(); ++i) {
    for (int k = 0; k < 6; ++k) {
      const int n = grid.links[i][k].inner;
      if (n < 0) continue;
      EXPECT_EQ(grid.links[n][k ^ 1].inner, static_cast<int>(i));
      EXPECT_NEAR(length(grid.inner[n] - grid.inner[i]), 1.0, 1e-12);
    }
  }
}

// K = 0.3 leaves the surface's nodes as they are and joins what lies deep: finer than an even lattice, it has fewer nodes and is nearer to the exact
// solution.
TEST(Polygrid, AdaptiveWithDepthItIsMoreAccurateWithFewerNodes) {
  const Polygrid even = grid_of("sphere", 0.5);
  const Polygrid adaptive = grid_of("sphere", 0.5, 0.3);
  EXPECT_EQ(adaptive.surface.size(), even.surface.size());
  EXPECT_LT(adaptive.inner.size(), even.inner.size() / 2);
  const Polygrid finer = grid_of("sphere", 0.4, 0.3);
  EXPECT_LT(finer.inner.size(), 0.8 * static_cast<double>(even.inner.size()));
  EXPECT_LT(sphere_error(0.4, 0.3), sphere_error(0.5));
  EXPECT_LT(sphere_error(0.5, 0.3), sphere_error(0.8, 0.3));
}

TEST(Polygrid, AdaptiveCellsFillWhatEvenOnesDoAndMeetFaceToFace) {
  const Polygrid even = grid_of("sphere", 0.5);
  const Polygrid adaptive = grid_of("sphere", 0.5, 1.0);
  double volume = 0.0;
  double all = 0.0;
  double largest = 0.0;
  for (const double v : adaptive.volumes) volume += v;
  for (const double v : even.volumes) all += v;
  for (const double v : adaptive.volumes) largest = std::max(largest, v);
  EXPECT_NEAR(volume, all, 1e-9 * all);
  EXPECT_GE(largest, 64.0 * 0.125 * (1.0 - 1e-9));
  for (std::size_t i = 0; i < adaptive.links.size(); ++i) {
    for (const auto& link : adaptive.links[i]) {
      if (link.inner < 0) continue;
      const auto& back = adaptive.links[link.inner];
      const auto found = std::ranges::find(back, static_cast<int>(i), &Polygrid::Link::inner);
      ASSERT_NE(found, back.end());
      EXPECT_EQ(std::ranges::count(back, static_cast<int>(i), &Polygrid::Link::inner), 1);
      EXPECT_NEAR(found->area, link.area, 1e-12);
      EXPECT_LE(std::abs(std::log2(found->reach / link.reach)), 1.0 + 1e-9);
    }
  }
}

TEST(Polygrid, WhatCannotBeDoneIsRefusedWithTheReason) {
  const auto sphere = make_shape("sphere", 20.0);
  EXPECT_THAT(make_polygrid(**sphere, 0.0, 0.0, {}).error().message, HasSubstr("expected > 0"));
  EXPECT_THAT(make_polygrid(**sphere, 1.0, -0.1, {}).error().message, HasSubstr("at least 0"));
  EXPECT_THAT(make_polygrid(**sphere, 1e-3, 0.0, {}).error().message, HasSubstr("larger spacing"));
  const auto ring = make_shape("torus", 0.1);  // a node in its hole, none in it
  EXPECT_THAT(make_polygrid(**ring, 1.0, 0.0, {}).error().message, HasSubstr("smaller spacing"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(make_polygrid(**sphere, 0.5, 0.0, stop.get_token()).error().code,
            ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::render
