#pragma once

#include "base/thread_team.h"
#include "render/mesh/signed_distance.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::bench {

/// Relative RMS error of the surface's fluence on a mesh of a sphere of 10 mm radius lit by q = (1 + cos theta) / 2, plain
/// optics, against the exact solution (tests/render/graph/lit_sphere.h).
/// Two-point volumes, corrected at most so often for links that lean (render/graph/leaning_links.h).
double graph_error(const render::TetMesh& sphere, int corrections, ThreadTeam& team);
double polygrid_error(const render::SignedDistance& sphere, double spacing, ThreadTeam& team);
double elements_error(const render::TetMesh& sphere, ThreadTeam& team);  ///< linear finite elements

}  // namespace opaline::bench
