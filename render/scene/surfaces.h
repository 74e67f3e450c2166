#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/scene/lighting.h"
#include "render/trace/triangle_tree.h"

namespace opaline::render {

/// Where light falls on a surface and how it lies there.
struct SurfacePlace {
  Vec3 place;
  Vec3 normal;        ///< of length 1
  double size = 0.0;  ///< about as long as the triangles are there, mm
};

/// The surfaces of all objects as one mesh with one tree over it, built once.
///
/// Threads: everything but add() and build() may be called from several threads.
class Surfaces {
 public:
  /// Cosine between facet and a vertex's normal below which the surface has a crease there: 45 degrees.
  static constexpr double kCrease = 0.707;

  Surfaces() = default;
  Surfaces(const Surfaces&) = delete;  // the tree points at the mesh
  Surfaces& operator=(const Surfaces&) = delete;

  /// Adds an object's surface; answers its number.
  int add(const TriangleMesh& mesh, const std::vector<Vec3>& normals);
  /// Moves an object's vertices; the tree keeps its order. Needs as many as were added, and build().
  void move(int object, const std::vector<Vec3>& vertices, const std::vector<Vec3>& normals);
  /// Call after the last add(). Errors: see TriangleTree.
  Result<void> build(const std::stop_token& stop = {});

  struct Hit {
    int object = 0;
    std::size_t triangle = 0;       ///< of the object's mesh
    std::array<int, 3> vertices{};  ///< of the object's mesh
    std::array<double, 3> weights{};
    Vec3 place{};
    Vec3 facet{};          ///< normal of the triangle
    Vec3 normal{};         ///< interpolated; the facet's own where the surface has a crease
    SurfacePlace start{};  ///< where rays leave it: on the curved surface that the normals mean
  };
  std::optional<Hit> nearest(const Ray& ray) const;

  /// Whether something hides a light from a place: rays start a little above the surface, and what lies nearer than a
  /// share of its `size` hides nothing, being the place's own facets.
  bool hides(const SurfacePlace& from, Vec3 towards, double distance) const;

  /// The mean over directions around the normal, spread as cosine_directions(), of weight(cosine); 0 for hidden ones.
  template <class Weight>
  double sky(const SurfacePlace& from,
             std::span<const Vec3> directions,
             const Weight& weight) const {
    const Frame frame = frame_around(from.normal);
    double sum = 0.0;
    for (const Vec3& d : directions) {
      if (!hides(from, frame.to_scene(d), std::numeric_limits<double>::infinity()))
        sum += weight(d.z);
    }
    return sum / static_cast<double>(directions.size());
  }

  Box bounds() const { return opaline::render::bounds(mesh_); }
  std::size_t triangles() const { return mesh_.triangles.size(); }

 private:
  Vec3 curved(const std::array<int, 3>& corners, const std::array<double, 3>& weights) const;

  TriangleMesh mesh_;
  std::vector<Vec3> normals_;
  std::vector<std::uint16_t> objects_;  // of each triangle
  std::vector<int> first_vertices_;     // of each object
  std::vector<std::size_t> first_triangles_;
  std::optional<TriangleTree> tree_;
};

}  // namespace opaline::render
