#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/pose.h"
#include "base/result.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// A solid cut into tetrahedra that meet face to face; lengths in mm. The
/// corners (a, b, c, d) of each have (b - a) x (c - a) . (d - a) > 0.
struct TetMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 4>> tets;
  bool operator==(const TetMesh&) const = default;
};

/// Errors: kInvalidArgument for a mesh without tetrahedra, a vertex that is not
/// finite, a corner that does not exist, a
///         tetrahedron that is inverted or has no volume, or three tetrahedra
///         at one face; the message has the first one.
Result<void> validate(const TetMesh& mesh);

/// For each tetrahedron and each of its corners the tetrahedron beyond the face
/// opposite that corner; -1 where that face is on the surface. Where more than
/// two tetrahedra share a face, only two are joined.
std::vector<std::array<int, 4>> neighbours_of(const TetMesh& mesh);

/// The corners of the face opposite corner `k`, counter-clockwise seen from
/// outside.
std::array<int, 3> face_of(const std::array<int, 4>& tet, int k);

double volume_of(const TetMesh& mesh, std::size_t tet);
Vec3 centroid_of(const TetMesh& mesh, std::size_t tet);

/// The faces without a neighbour, over the same vertices as the tetrahedra.
std::vector<std::array<int, 3>> surface_of(const TetMesh& mesh);

/// The surface as a mesh of its own.
TriangleMesh surface_mesh(const TetMesh& mesh);

/// How well a mesh is shaped.
struct TetQuality {
  std::size_t tets = 0;
  std::size_t surface_triangles = 0;
  double volume = 0.0;             ///< mm^3
  double smallest_dihedral = 0.0;  ///< degrees
  double largest_dihedral = 0.0;   ///< degrees
  int components = 0;              ///< connected by faces
};
TetQuality quality_of(const TetMesh& mesh);

}  // namespace opaline::render
