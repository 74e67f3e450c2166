#include "render/mesh/triangle_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numeric>
#include <span>
#include <tuple>
#include <unordered_map>

#include "render/mesh/mesh_formats.h"

namespace opaline::render {
namespace {

struct PlaceHash {
  std::size_t operator()(const Vec3& p) const {
    std::uint64_t hash = 0;
    for (const double x : {p.x, p.y, p.z}) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &x, sizeof bits);
      hash = (hash ^ bits) * 0x9e3779b97f4a7c15ULL;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

bool is_finite(Vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// The edges of a mesh, those that have the same lower vertex side by side.
class DirectedEdges {
 public:
  struct Edge {
    int high = 0;
    bool forward = true;
    bool operator<(const Edge& other) const {
      return std::tie(high, forward) < std::tie(other.high, other.forward);
    }
  };

  explicit DirectedEdges(const TriangleMesh& mesh) : starts_(mesh.vertices.size() + 1) {
    for_each(mesh, [&](int low, Edge) { ++starts_[low + 1]; });
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    edges_.resize(starts_.back());
    std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
    for_each(mesh, [&](int low, Edge edge) { edges_[next[low]++] = edge; });
  }
  /// Sorted.
  std::span<Edge> of(std::size_t low) {
    const std::span<Edge> found(edges_.data() + starts_[low], starts_[low + 1] - starts_[low]);
    std::ranges::sort(found, std::less<>());
    return found;
  }

 private:
  template <class Work>
  static void for_each(const TriangleMesh& mesh, const Work& work) {
    for (const auto& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const int a = t[k];
        const int b = t[(k + 1) % 3];
        if (a != b) work(std::min(a, b), Edge{std::max(a, b), a < b});
      }
    }
  }
  std::vector<std::size_t> starts_;
  std::vector<Edge> edges_;
};

/// Counts what is wrong along the edges; answers how many different edges there are.
std::size_t count_edges(const TriangleMesh& mesh,
                        MeshTopology& found,
                        const std::stop_token& stop) {
  DirectedEdges all(mesh);
  std::size_t different = 0;
  for (std::size_t v = 0; v < mesh.vertices.size() && !stopped_at(v, stop); ++v) {
    const auto edges = all.of(v);
    for (std::size_t i = 0; i < edges.size(); ++different) {
      std::size_t end = i + 1;
      while (end < edges.size() && edges[end].high == edges[i].high) ++end;
      if (end - i == 1) ++found.open_edges;
      if (end - i > 2) ++found.crowded_edges;
      if (end - i == 2 && edges[i].forward == edges[i + 1].forward) ++found.flipped_edges;
      i = end;
    }
  }
  return different;
}

int root_of(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

struct Parts {
  int components = 0;
  std::size_t used_vertices = 0;
};

Parts count_parts(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<bool> used(parent.size(), false);
  for (const auto& t : mesh.triangles) {
    for (const int v : t) {
      used[v] = true;
      parent[root_of(parent, v)] = root_of(parent, t[0]);
    }
  }
  Parts parts;
  for (std::size_t v = 0; v < parent.size(); ++v) {
    if (!used[v]) continue;
    ++parts.used_vertices;
    if (parent[v] == static_cast<int>(v)) ++parts.components;
  }
  return parts;
}

}  // namespace

Result<void> validate(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return invalid_argument("the mesh has no triangles");
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!is_finite(mesh.vertices[v]))
      return invalid_argument(fmt::format("vertex {} is not finite", v));
  }
  const auto count = static_cast<int>(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int v : mesh.triangles[t]) {
      if (v < 0 || v >= count) {
        return invalid_argument(fmt::format("triangle {} names vertex {} of {}", t, v, count));
      }
    }
  }
  return ok();
}

MeshTopology topology(const TriangleMesh& mesh, const std::stop_token& stop) {
  MeshTopology found;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]];
    const Vec3 normal = cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    if (!(length(normal) > 0.0)) ++found.degenerate_triangles;
    found.area += 0.5 * length(normal);
    found.volume += dot(a, normal) / 6.0;
  }
  const std::size_t edges = count_edges(mesh, found, stop);
  if (stop.stop_requested()) return found;
  const Parts parts = count_parts(mesh);
  found.components = parts.components;
  const long euler = static_cast<long>(parts.used_vertices) - static_cast<long>(edges) +
                     static_cast<long>(mesh.triangles.size());
  found.genus = static_cast<int>((2L * parts.components - euler) / 2);
  return found;
}

TriangleMesh weld(const TriangleMesh& mesh, const std::stop_token& stop) {
  TriangleMesh welded;
  welded.triangles.reserve(mesh.triangles.size());
  std::unordered_map<Vec3, int, PlaceHash> places;
  places.reserve(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    if (stopped_at(welded.triangles.size(), stop)) return welded;
    std::array<int, 3> corners{};
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = mesh.vertices[t[k]] + Vec3{};  // -0 becomes 0
      const auto [place, fresh] = places.try_emplace(p, static_cast<int>(welded.vertices.size()));
      if (fresh) welded.vertices.push_back(p);
      corners[k] = place->second;
    }
    welded.triangles.push_back(corners);
  }
  return welded;
}

Box bounds(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return {};
  Box box{mesh.vertices[0], mesh.vertices[0]};
  for (const Vec3& p : mesh.vertices) {
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  return box;
}

}  // namespace opaline::render
