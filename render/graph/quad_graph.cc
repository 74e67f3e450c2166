#include "render/graph/quad_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

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

std::uint64_t spread(std::uint32_t x) {
  std::uint64_t spread = 0;
  for (int b = 0; b < 20; ++b) spread |= static_cast<std::uint64_t>(x >> b & 1U) << (3 * b);
  return spread;
}

/// Positions sorted along the curve: order[new] = old.
std::vector<int> curve_order(const std::vector<Vec3>& places) {
  const Box box = bounds({places, {}});
  const Vec3 size = box.size();
  const double scale = 1048575.0 / std::max({size.x, size.y, size.z, 1e-300});
  std::vector<std::uint64_t> codes(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 p = (places[i] - box.low) * scale;
    codes[i] = spread(static_cast<std::uint32_t>(p.x)) |
               spread(static_cast<std::uint32_t>(p.y)) << 1 |
               spread(static_cast<std::uint32_t>(p.z)) << 2;
  }
  std::vector<int> order(places.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int i) { return std::pair(codes[i], i); });
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
  std::vector<Vec3> centroids;
  centroids.reserve(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) centroids.push_back(centroid_of(mesh, t));
  TetMesh packed;
  std::vector<int> number(mesh.vertices.size(), -1);
  packed.tets.reserve(mesh.tets.size());
  for (const int t : curve_order(centroids)) {
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
