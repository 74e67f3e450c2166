#pragma once

#include "reconstruct/diffusion/boundary.h"
#include "render/graph/polygrid.h"
#include "render/scene/subsurface.h"

namespace opaline::render {

/// Two-point volumes on the QuadGraph of the tetrahedra, or on a lattice (render/graph/two_point.h); single precision unless
/// the tolerance asks for more. Errors: see Subsurface::create().
Result<std::unique_ptr<Subsurface>> make_graph_subsurface(
    TetMesh mesh,
    const SignedDistance& solid,
    const Subsurface::MaterialAt& material,
    const reconstruct::diffusion::Boundary& boundary,
    const DiffusionOptions& options,
    ThreadTeam& team);

Result<std::unique_ptr<Subsurface>> make_polygrid_subsurface(
    Polygrid grid,
    TetMesh mesh,
    const SignedDistance& solid,
    const Subsurface::MaterialAt& material,
    const reconstruct::diffusion::Boundary& boundary,
    const DiffusionOptions& options,
    ThreadTeam& team);

}  // namespace opaline::render
