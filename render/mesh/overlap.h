#pragma once

#include <stop_token>

#include "render/mesh/mesh_distance.h"

namespace opaline::render {

/// The share of a mesh's surface that lies within what the mesh encloses: where parts overlap, one is inside another, or a
/// surface passes through itself. Both sides of such a place are inside, so w > 1/2 (mesh_distance.h) just above and just below;
/// of a place on the outside, and of the wall of a cavity, one side is not, whichever way the mesh is turned.
///
/// Looks at 8,000 places, spread over all triangles. 0 when asked to stop.
double buried_share(const TriangleMesh& mesh,
                    const MeshDistance& distance,
                    const std::stop_token& stop);

}  // namespace opaline::render
