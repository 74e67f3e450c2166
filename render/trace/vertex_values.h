#pragma once

#include <vector>

#include "render/graph/optics.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Values of triangles (a QuadGraph's surface nodes) as values of the vertices: the average over the triangles around each,
/// weighted by area, and on top half of the same average of what the triangles then have beyond the means of their corners
/// (as "twicing", Tukey, Exploratory data analysis, 1977). An average alone flattens what is curved by r^2 / 4 of its Laplacian, r
/// from a corner to the middles around it; so does the mean of its corners for a triangle's middle, hence half. Fluence is not
/// let below 0, where the sum may be beside a shadow's edge. 0 where a vertex has no triangle. Needs a valid mesh, and as many
/// values as it has triangles.
SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles);

/// The normals of the vertices: the sum of the triangles around each, weighted by area; 0 where that cancels.
std::vector<Vec3> vertex_normals(const TriangleMesh& surface);

}  // namespace opaline::render
