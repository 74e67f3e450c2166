#include "render/trace/vertex_values.h"

#include <algorithm>
#include <array>

namespace opaline::render {
namespace {

Vec3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]];
  return cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a) * 0.5;
}

}  // namespace

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
