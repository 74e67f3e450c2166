#include "render/trace/vertex_values.h"

#include <algorithm>
#include <array>

namespace opaline::render {
namespace {

Vec3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]];
  return cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a) * 0.5;
}

using Values = std::vector<std::array<float, 3>>;

Values averaged(const TriangleMesh& mesh, const Values& values) {
  std::vector<std::array<double, 3>> sums(mesh.vertices.size());
  std::vector<double> areas(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = length(area_vector(mesh, mesh.triangles[t]));
    for (const int v : mesh.triangles[t]) {
      areas[v] += area;
      for (int c = 0; c < 3; ++c) sums[v][c] += area * values[t][c];
    }
  }
  Values means(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    if (areas[v] == 0.0) continue;
    for (int c = 0; c < 3; ++c) means[v][c] = static_cast<float>(sums[v][c] / areas[v]);
  }
  return means;
}

/// What the triangles have beyond the means of their corners.
Values left_over(const TriangleMesh& mesh, const Values& values, const Values& corners) {
  Values rest = values;
  for (std::size_t t = 0; t < rest.size(); ++t) {
    for (const int v : mesh.triangles[t]) {
      for (int c = 0; c < 3; ++c) rest[t][c] -= corners[v][c] / 3.0F;
    }
  }
  return rest;
}

/// A smooth function's average over the triangles around a corner is off by r^2 / 4 of its Laplacian, r from the corner to their
/// middles, and the middle of a triangle is off the mean of its corners by as much again.
constexpr float kHalf = 0.5F;

Values averaged_twice(const TriangleMesh& mesh, const Values& values) {
  Values corners = averaged(mesh, values);
  const Values more = averaged(mesh, left_over(mesh, values, corners));
  for (std::size_t v = 0; v < corners.size(); ++v) {
    for (int c = 0; c < 3; ++c) corners[v][c] += kHalf * more[v][c];
  }
  return corners;
}

}  // namespace

SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles) {
  SurfaceLight light{averaged_twice(surface, of_triangles.fluence),
                     averaged_twice(surface, of_triangles.net_flux)};
  for (auto& fluence : light.fluence) {
    for (float& channel : fluence) channel = std::max(channel, 0.0F);
  }
  return light;
}

std::vector<Vec3> vertex_normals(const TriangleMesh& surface) {
  std::vector<Vec3> normals(surface.vertices.size());
  for (const auto& triangle : surface.triangles) {
    const Vec3 area = area_vector(surface, triangle);
    for (const int v : triangle) normals[v] = normals[v] + area;
  }
  for (Vec3& normal : normals) {
    if (length(normal) > 0.0) normal = normalized(normal);
  }
  return normals;
}

}  // namespace opaline::render
