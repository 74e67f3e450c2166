#pragma once

#include <array>
#include <vector>

#include "render/mesh/triangle_mesh.h"
#include "render/solver/aggregation.h"

namespace opaline::render {

/// Values in the middles of a surface's triangles as values of its vertices: at each the least-squares polynomial
///
///   f(u, w) = c_0 + c_1 u + c_2 w + c_3 u^2 + c_4 u w + c_5 w^2
///
/// through the triangles of two rings around it, u and w across the vertex's normal, read at u = w = 0. An average flattens what
/// is curved and leans to where triangles are small; this is exact for what is quadratic along a plane, and off by third order
/// elsewhere. Triangles that face away do not count; where too few are left, or they do not determine the polynomial, its
/// quadratic and then its linear part is left out: the last is the average.
///
/// A triangle counts with its area and exp(-d^2 / r^2), d from the vertex to its middle, r the mean of d over the first ring.
///
/// It reads a graph's fluence. Its flux follows from that and the light at the vertex, not from the triangles' flux: that jumps
/// where light does.
///
/// Rows: vertices; columns: triangles. The weights of a row add up to 1, and some are negative. Needs a valid mesh.
Interpolation<float> fitted_interpolation(const TriangleMesh& surface);

/// Where a value is known on a surface.
struct SurfaceSample {
  Vec3 place;
  Vec3 area;  ///< that it stands for, along the surface's normal, mm^2
};

/// The same of samples that are no mesh's triangles, as a lattice's boundary nodes: through the 48 nearest of each vertex, r 1.5 times the
/// mean of d over the nearest six, since values there scatter from node to node. Columns: samples; there must be some.
Interpolation<float> fitted_interpolation(const std::vector<SurfaceSample>& samples,
                                          const TriangleMesh& surface);

using SurfaceValues = std::vector<std::array<float, 3>>;  ///< red, green, blue
/// The values of rows' triangles at their vertices; 0 in an empty row.
SurfaceValues interpolated(const Interpolation<float>& rows, const SurfaceValues& values);

}  // namespace opaline::render
