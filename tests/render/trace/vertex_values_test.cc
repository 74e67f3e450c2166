#include "render/trace/vertex_values.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/mesh/shapes.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

using Values = std::vector<std::array<float, 3>>;

TriangleMesh ball(double spacing) {
  const auto solid = make_shape("sphere", 2.0);
  auto tets = stuff(**solid, {.spacing_mm = spacing}, {});
  EXPECT_TRUE(tets);
  return surface_mesh(*tets);
}

/// A spherical harmonic of order 4: curved everywhere.
float harmonic(Vec3 p) {
  const Vec3 n = normalized(p);
  return static_cast<float>(n.x * n.x * n.x * n.x - 6.0 * n.x * n.x * n.y * n.y +
                            n.y * n.y * n.y * n.y);
}

Values on_triangles(const TriangleMesh& mesh) {
  Values values;
  for (const auto& [a, b, c] : mesh.triangles) {
    values.emplace_back().fill(harmonic(mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]));
  }
  return values;
}

Values plain_average(const TriangleMesh& mesh, const Values& values) {
  Values sums(mesh.vertices.size());
  std::vector<double> areas(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [i, j, k] = mesh.triangles[t];
    const Vec3 a = mesh.vertices[i];
    const double area = length(cross(mesh.vertices[j] - a, mesh.vertices[k] - a));
    for (const int v : {i, j, k}) {
      areas[v] += area;
      sums[v][0] += static_cast<float>(area * values[t][0]);
    }
  }
  for (std::size_t v = 0; v < sums.size(); ++v) sums[v][0] /= static_cast<float>(areas[v]);
  return sums;
}

double error(const TriangleMesh& mesh, const Values& values) {
  double sum = 0.0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    sum += std::pow(values[v][0] - harmonic(mesh.vertices[v]), 2);
  }
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// What is left is mostly that triangles lie unevenly around a corner: a plain average has both.
TEST(VertexValues, WhatIsCurvedIsFlattenedLessThanByAverages) {
  for (const double spacing : {0.3, 0.15}) {
    const TriangleMesh mesh = ball(spacing);
    const Values values = on_triangles(mesh);
    const SurfaceLight light = at_vertices(mesh, {values, values});
    EXPECT_LT(error(mesh, light.net_flux), 0.9 * error(mesh, plain_average(mesh, values)));
  }
}

TEST(VertexValues, WhatIsTheSameEverywhereStaysAndFluenceIsNeverBelowZero) {
  const TriangleMesh mesh = ball(0.3);
  Values values(mesh.triangles.size(), {2.0F, 3.0F, 0.0F});
  for (const auto& v : at_vertices(mesh, {values, values}).fluence) {
    EXPECT_NEAR(v[0], 2.0, 1e-5);
    EXPECT_NEAR(v[1], 3.0, 1e-5);
    EXPECT_EQ(v[2], 0.0);
  }
  for (std::size_t t = 0; t < values.size(); ++t) {  // a shadow's edge
    if (mesh.vertices[mesh.triangles[t][0]].x > 0.0) values[t].fill(0.0F);
  }
  for (const auto& v : at_vertices(mesh, {values, values}).fluence) {
    for (const float channel : v) EXPECT_GE(channel, 0.0F);
  }
}

}  // namespace
}  // namespace opaline::render
