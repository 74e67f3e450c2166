#include "render/tetrahedra/tet_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace opaline::render {
namespace {

struct FaceSide {
  std::array<int, 3> corners{};  // sorted
  int tet = 0;
  int opposite = 0;
};

std::vector<FaceSide> sorted_sides(const TetMesh& mesh) {
  std::vector<FaceSide> sides;
  sides.reserve(4 * mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      FaceSide side{face_of(mesh.tets[t], k), static_cast<int>(t), k};
      std::ranges::sort(side.corners);
      sides.push_back(side);
    }
  }
  std::ranges::sort(sides, {}, &FaceSide::corners);
  return sides;
}

double six_volumes(const TetMesh& mesh, std::size_t tet) {
  const auto& t = mesh.tets[tet];
  const Vec3 a = mesh.vertices[t[0]];
  return dot(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a), mesh.vertices[t[3]] - a);
}

Result<void> check_tet(const TetMesh& mesh, std::size_t tet) {
  for (const int v : mesh.tets[tet]) {
    if (v < 0 || v >= static_cast<int>(mesh.vertices.size())) {
      return invalid_argument(
          fmt::format("tetrahedron {} names vertex {} of {}", tet, v, mesh.vertices.size()));
    }
  }
  if (!(six_volumes(mesh, tet) > 0.0)) {
    return invalid_argument(fmt::format("tetrahedron {} is inverted or has no volume", tet));
  }
  return ok();
}

Vec3 unit_normal(const TetMesh& mesh, const std::array<int, 3>& face) {
  const Vec3 a = mesh.vertices[face[0]];
  return normalized(cross(mesh.vertices[face[1]] - a, mesh.vertices[face[2]] - a));
}

int root_of(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

int count_components(const std::vector<std::array<int, 4>>& neighbours) {
  std::vector<int> parent(neighbours.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (std::size_t t = 0; t < neighbours.size(); ++t) {
    for (const int n : neighbours[t]) {
      if (n >= 0) parent[root_of(parent, n)] = root_of(parent, static_cast<int>(t));
    }
  }
  int components = 0;
  for (std::size_t t = 0; t < parent.size(); ++t) components += parent[t] == static_cast<int>(t);
  return components;
}

}  // namespace

std::array<int, 3> face_of(const std::array<int, 4>& tet, int k) {
  constexpr int faces[4][3]{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  return {tet[faces[k][0]], tet[faces[k][1]], tet[faces[k][2]]};
}

Result<void> validate(const TetMesh& mesh) {
  if (mesh.tets.empty()) return invalid_argument("the mesh has no tetrahedra");
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3 p = mesh.vertices[v];
    if (!std::isfinite(p.x + p.y + p.z))
      return invalid_argument(fmt::format("vertex {} is not finite", v));
  }
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (auto checked = check_tet(mesh, t); !checked) return checked.error();
  }
  const std::vector<FaceSide> sides = sorted_sides(mesh);
  for (std::size_t i = 2; i < sides.size(); ++i) {
    if (sides[i].corners == sides[i - 2].corners) {
      return invalid_argument(
          fmt::format("three tetrahedra share a face of tetrahedron {}", sides[i].tet));
    }
  }
  return ok();
}

std::vector<std::array<int, 4>> neighbours_of(const TetMesh& mesh) {
  std::vector<std::array<int, 4>> neighbours(mesh.tets.size(), {-1, -1, -1, -1});
  const std::vector<FaceSide> sides = sorted_sides(mesh);
  for (std::size_t i = 1; i < sides.size(); ++i) {
    if (sides[i].corners != sides[i - 1].corners) continue;
    neighbours[sides[i].tet][sides[i].opposite] = sides[i - 1].tet;
    neighbours[sides[i - 1].tet][sides[i - 1].opposite] = sides[i].tet;
    ++i;
  }
  return neighbours;
}

double volume_of(const TetMesh& mesh, std::size_t tet) { return six_volumes(mesh, tet) / 6.0; }

Vec3 centroid_of(const TetMesh& mesh, std::size_t tet) {
  const auto& t = mesh.tets[tet];
  return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]] + mesh.vertices[t[3]]) *
         0.25;
}

std::vector<std::array<int, 3>> surface_of(const TetMesh& mesh) {
  const auto neighbours = neighbours_of(mesh);
  std::vector<std::array<int, 3>> surface;
  for (std::size_t t = 0; t < neighbours.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      if (neighbours[t][k] < 0) surface.push_back(face_of(mesh.tets[t], k));
    }
  }
  return surface;
}

TriangleMesh surface_mesh(const TetMesh& mesh) {
  TriangleMesh surface;
  std::vector<int> number(mesh.vertices.size(), -1);
  for (auto triangle : surface_of(mesh)) {
    for (int& v : triangle) {
      if (number[v] < 0) {
        number[v] = static_cast<int>(surface.vertices.size());
        surface.vertices.push_back(mesh.vertices[v]);
      }
      v = number[v];
    }
    surface.triangles.push_back(triangle);
  }
  return surface;
}

TetQuality quality_of(const TetMesh& mesh) {
  const auto neighbours = neighbours_of(mesh);
  TetQuality quality{.tets = mesh.tets.size(), .components = count_components(neighbours)};
  double largest = -1.0;  // of the cosines
  double smallest = 1.0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    quality.volume += volume_of(mesh, t);
    std::array<Vec3, 4> normals;
    for (int k = 0; k < 4; ++k) {
      normals[k] = unit_normal(mesh, face_of(mesh.tets[t], k));
      quality.surface_triangles += neighbours[t][k] < 0;
      for (int m = 0; m < k; ++m) {
        largest = std::max(largest, -dot(normals[k], normals[m]));
        smallest = std::min(smallest, -dot(normals[k], normals[m]));
      }
    }
  }
  const auto degrees = [](double cosine) {
    return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  };
  quality.smallest_dihedral = degrees(largest);
  quality.largest_dihedral = degrees(smallest);
  return quality;
}

}  // namespace opaline::render
