#include "render/graph/quad_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace opaline::render {
namespace {

struct FaceShape {
  Vec3 centroid;
  Vec3 normal;
  double area = 0.0;
};

FaceShape shape_of(const TetMesh& mesh, const std::array<int, 3>& face) {
  const Vec3 a = mesh.vertices[face[0]];
  const Vec3 b = mesh.vertices[face[1]];
  const Vec3 c = mesh.vertices[face[2]];
  const Vec3 n = cross(b - a, c - a);
  return {(a + b + c) * (1.0 / 3.0), normalized(n), 0.5 * length(n)};
}

/// Tetrahedra layer by layer, each layer the neighbours of the one before; every part of the mesh begins at its end along the
/// box's longest edge. order[new] = old.
std::vector<int> layer_order(const TetMesh& mesh) {
  const Vec3 size = bounds({mesh.vertices, {}}).size();
  const double longest = std::max({size.x, size.y, size.z});
  const Vec3 along{size.x == longest ? 1.0 : 0.0,
                   size.x < longest && size.y == longest ? 1.0 : 0.0,
                   std::max(size.x, size.y) < longest ? 1.0 : 0.0};
  std::vector<std::pair<double, int>> starts;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    starts.emplace_back(dot(centroid_of(mesh, t), along), static_cast<int>(t));
  std::ranges::sort(starts);
  const auto neighbours = neighbours_of(mesh);
  std::vector<char> seen(mesh.tets.size(), 0);
  std::vector<int> order;
  order.reserve(mesh.tets.size());
  const auto take = [&](int t) {
    if (t < 0 || seen[t] != 0) return;
    seen[t] = 1;
    order.push_back(t);
  };
  std::size_t next = 0;
  for (const auto& [place, start] : starts) {
    take(start);
    for (; next < order.size(); ++next)
      for (const int neighbour : neighbours[order[next]]) take(neighbour);
  }
  return order;
}

}  // namespace

QuadGraph make_quad_graph(const TetMesh& mesh) {
  QuadGraph graph;
  const auto neighbours = neighbours_of(mesh);
  const std::size_t count = mesh.tets.size();
  graph.inner.resize(count);
  graph.volumes.resize(count);
  graph.links.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    for (int k = 0; k < 4; ++k) {
      QuadGraph::Link& link = graph.links[t][k];
      link.inner = neighbours[t][k];
      if (link.inner >= 0) continue;
      link.surface = static_cast<int>(graph.surface.size());
      graph.surface.push_back({{}, {}, static_cast<int>(t)});
    }
  }
  update_geometry(mesh, graph);
  return graph;
}

void update_geometry(const TetMesh& mesh, QuadGraph& graph) {
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    graph.inner[t] = centroid_of(mesh, t);
    graph.volumes[t] = volume_of(mesh, t);
  }
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      const FaceShape face = shape_of(mesh, face_of(mesh.tets[t], k));
      QuadGraph::Link& link = graph.links[t][k];
      const Vec3 target = link.inner >= 0 ? graph.inner[link.inner] : face.centroid;
      link.area = face.area;
      link.reach = dot(face.centroid - graph.inner[t], face.normal);
      link.length = length(target - graph.inner[t]);
      if (link.inner >= 0) continue;
      graph.surface[link.surface] = {
          face.centroid, face.normal, static_cast<int>(t), face.area, link.reach, link.length};
    }
  }
}

TetMesh pack(const TetMesh& mesh) {
  TetMesh packed;
  std::vector<int> number(mesh.vertices.size(), -1);
  packed.tets.reserve(mesh.tets.size());
  for (const int t : layer_order(mesh)) {
    auto tet = mesh.tets[t];
    for (int& v : tet) {
      if (number[v] < 0) {
        number[v] = static_cast<int>(packed.vertices.size());
        packed.vertices.push_back(mesh.vertices[v]);
      }
      v = number[v];
    }
    packed.tets.push_back(tet);
  }
  return packed;
}

}  // namespace opaline::render
