#include "render/trace/vertex_values.h"

#include <array>

namespace opaline::render {
namespace {

Vec3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]];
  return cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a) * 0.5;
}

std::vector<std::array<float, 3>> averaged(const TriangleMesh& mesh,
                                           const std::vector<std::array<float, 3>>& values) {
  std::vector<std::array<double, 3>> sums(mesh.vertices.size());
  std::vector<double> areas(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = length(area_vector(mesh, mesh.triangles[t]));
    for (const int v : mesh.triangles[t]) {
      areas[v] += area;
      for (int c = 0; c < 3; ++c) sums[v][c] += area * values[t][c];
    }
  }
  std::vector<std::array<float, 3>> means(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    if (areas[v] == 0.0) continue;
    for (int c = 0; c < 3; ++c) means[v][c] = static_cast<float>(sums[v][c] / areas[v]);
  }
  return means;
}

}  // namespace

SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles) {
  return {averaged(surface, of_triangles.fluence), averaged(surface, of_triangles.net_flux)};
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
