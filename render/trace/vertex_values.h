#pragma once

#include <vector>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// The normals of the vertices: the sum of the triangles around each, weighted by area; 0 where that cancels.
std::vector<Vec3> vertex_normals(const TriangleMesh& surface);

}  // namespace opaline::render
