#pragma once

#include <vector>

#include "render/graph/optics.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Values of triangles (a QuadGraph's surface nodes) as values of the vertices: the average over the triangles around each,
/// weighted by area. 0 where a vertex has no triangle. Needs a valid mesh, and as many values as it has triangles.
SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles);

/// The normals of the vertices: the sum of the triangles around each, weighted by area; 0 where that cancels.
std::vector<Vec3> vertex_normals(const TriangleMesh& surface);

}  // namespace opaline::render
