#pragma once

#include <stop_token>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// The share of a shape's surface that stands out of what was cut from it by more than `size_mm`, an element's: limbs and sheets
/// too thin for elements of that size, and sheets that enclose nothing. Looks at the middles of 20,000 of its triangles at most,
/// spread over all. 0 when asked to stop.
double lost_share(const TriangleMesh& shape,
                  const TriangleMesh& cut,
                  double size_mm,
                  const std::stop_token& stop);

}  // namespace opaline::render
