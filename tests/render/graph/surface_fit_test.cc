#include "render/graph/surface_fit.h"

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

/// A flat sheet of uneven triangles, its faces up.
TriangleMesh sheet(int cells) {
  TriangleMesh mesh;
  const auto at = [&](int i, int j) { return i * (cells + 1) + j; };
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j)
      mesh.vertices.push_back(
          {i + 0.3 * std::sin(7.0 * i + 3.0 * j), j + 0.3 * std::cos(5.0 * i * j), 0.0});
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TEST(SurfaceFit, IsExactForWhatIsQuadraticOnAPlane) {
  const TriangleMesh mesh = sheet(8);
  const auto quadratic = [](Vec3 p) {
    return 3.0 - 0.7 * p.x + 0.2 * p.y + 0.11 * p.x * p.x - 0.3 * p.x * p.y + 0.05 * p.y * p.y;
  };
  Values values;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) * (1.0 / 3.0);
    values.emplace_back().fill(static_cast<float>(quadratic(middle)));
  }
  const Values read = interpolated(fitted_interpolation(mesh), values);
  for (int i = 1; i < 8; ++i)
    for (int j = 1; j < 8; ++j) {
      const int v = i * 9 + j;
      EXPECT_NEAR(read[v][0], quadratic(mesh.vertices[v]), 2e-4) << i << ' ' << j;
    }
}

TEST(SurfaceFit, ErrsOnABallAsOfThirdOrderAndFarLessThanAnAverage) {
  std::array<double, 2> errors{};
  for (const int n : {0, 1}) {
    const TriangleMesh mesh = ball(n == 0 ? 0.3 : 0.15);
    const Values values = on_triangles(mesh);
    errors[n] = error(mesh, interpolated(fitted_interpolation(mesh), values));
    EXPECT_LT(errors[n], 0.25 * error(mesh, plain_average(mesh, values)));
  }
  EXPECT_GT(errors[0] / errors[1], 5.0);
}

TEST(SurfaceFit, KeepsWhatIsTheSameEverywhere) {
  for (const TriangleMesh& mesh : {ball(0.3), sheet(3)}) {
    const Values values(mesh.triangles.size(), {2.0F, 3.0F, 0.0F});
    for (const auto& v : interpolated(fitted_interpolation(mesh), values)) {
      EXPECT_NEAR(v[0], 2.0, 1e-5);
      EXPECT_NEAR(v[1], 3.0, 1e-5);
      EXPECT_EQ(v[2], 0.0);
    }
  }
}

// Two sheets back to back: what shines on the one is not seen on the other.
TEST(SurfaceFit, DoesNotLookAroundAThinEdge) {
  TriangleMesh mesh = sheet(6);
  const std::size_t above = mesh.triangles.size();
  for (std::size_t t = 0; t < above; ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    mesh.triangles.push_back({a, c, b});
  }
  // A vertex of both sheets has no normal; each sheet has vertices of its own but at the left edge.
  const auto count = static_cast<int>(mesh.vertices.size());
  const std::vector<Vec3> top = mesh.vertices;
  for (const Vec3& p : top) mesh.vertices.push_back(p - Vec3{0.0, 0.0, 0.01});
  for (std::size_t t = above; t < mesh.triangles.size(); ++t)
    for (int& v : mesh.triangles[t])
      if (v >= 7) v += count;
  Values values(mesh.triangles.size(), {1.0F, 1.0F, 1.0F});
  for (std::size_t t = above; t < values.size(); ++t) values[t].fill(0.0F);
  const Values read = interpolated(fitted_interpolation(mesh), values);
  for (int v = 7; v < count; ++v) EXPECT_NEAR(read[v][0], 1.0, 1e-5) << v;
}

/// Samples strewn over a plane, each for the same area: a golden spiral.
std::vector<SurfaceSample> strewn(int count, double radius) {
  std::vector<SurfaceSample> samples;
  for (int n = 0; n < count; ++n) {
    const double r = radius * std::sqrt((n + 0.5) / count);
    samples.push_back({{r * std::cos(2.4 * n), r * std::sin(2.4 * n), 0.0}, {0.0, 0.0, 1.0}});
  }
  return samples;
}

TEST(SurfaceFit, ReadsSamplesThatAreNoTrianglesAndNotThoseOfAnotherSide) {
  std::vector<SurfaceSample> samples = strewn(400, 10.0);
  Values values;
  const auto quadratic = [](Vec3 p) {
    return 2.0 - 0.3 * p.x + 0.04 * p.x * p.y - 0.1 * p.y * p.y;
  };
  for (const SurfaceSample& s : samples) {
    values.emplace_back().fill(static_cast<float>(quadratic(s.place)));
  }
  for (SurfaceSample s : strewn(400, 10.0)) {  // the back of a sheet, dark
    s.place.z = -0.1;
    s.area.z = -1.0;
    samples.push_back(s);
    values.push_back({0.0F, 0.0F, 0.0F});
  }
  TriangleMesh mesh = sheet(6);
  for (Vec3& p : mesh.vertices) p = p - Vec3{3.0, 3.0, 0.0};
  const Values read = interpolated(fitted_interpolation(samples, mesh), values);
  for (std::size_t v = 0; v < read.size(); ++v) {
    EXPECT_NEAR(read[v][0], quadratic(mesh.vertices[v]), 2e-4) << v;
  }
}

TEST(SurfaceFit, AVertexWithoutTrianglesIsDark) {
  TriangleMesh mesh = ball(0.3);
  mesh.vertices.push_back({5.0, 0.0, 0.0});
  const Values values(mesh.triangles.size(), {2.0F, 2.0F, 2.0F});
  EXPECT_EQ(interpolated(fitted_interpolation(mesh), values).back()[0], 0.0F);
}

}  // namespace
}  // namespace opaline::render
