#pragma once

#include <array>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::render {

/// An axis-aligned box, mm.
struct Box {
  Vec3 low;
  Vec3 high;
  Vec3 size() const { return high - low; }
  Vec3 centre() const { return (low + high) * 0.5; }
};

/// A surface of triangles, counter-clockwise seen from outside; lengths in mm.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
  bool operator==(const TriangleMesh&) const = default;
};

/// Errors: kInvalidArgument for a mesh without triangles, a vertex that is not finite, or a triangle that names a vertex
///         the mesh does not have; the message has the first one.
Result<void> validate(const TriangleMesh& mesh);

/// What the edges and triangles of a mesh say about it. A solid's surface is watertight: every edge has two triangles,
/// which run along it in opposite directions.
struct MeshTopology {
  std::size_t degenerate_triangles = 0;  ///< with a corner twice, or no area
  std::size_t open_edges = 0;            ///< of one triangle only: the rims of holes
  std::size_t crowded_edges = 0;         ///< of more than two triangles
  std::size_t flipped_edges = 0;  ///< of two triangles that run along it in the same direction
  int components = 0;             ///< connected by shared vertices
  int genus = 0;                  ///< handles, summed over components; meaningful when watertight
  double area = 0.0;              ///< mm^2
  double volume = 0.0;            ///< enclosed, mm^3; negative when inside out
  bool watertight() const { return open_edges + crowded_edges + flipped_edges == 0; }
};

/// Needs a valid mesh. Corners that coincide count as one only where they are one vertex: see weld().
/// Asked to stop, it answers something else soon.
MeshTopology topology(const TriangleMesh& mesh, const std::stop_token& stop = {});

/// The mesh with vertices at exactly the same place made one, unused ones dropped. Asked to stop, it answers a part soon.
TriangleMesh weld(const TriangleMesh& mesh, const std::stop_token& stop = {});

Box bounds(const TriangleMesh& mesh);

}  // namespace opaline::render
