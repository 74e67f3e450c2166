#pragma once

#include "reconstruct/diffusion/boundary.h"
#include "render/scene/subsurface.h"

namespace opaline::render {

/// Linear finite elements in double precision (render/graph/finite_elements.h). Errors: see Subsurface::create().
Result<std::unique_ptr<Subsurface>> make_elements_subsurface(
    TetMesh mesh,
    const SignedDistance& solid,
    const Subsurface::MaterialAt& material,
    const reconstruct::diffusion::Boundary& boundary,
    const DiffusionOptions& options,
    ThreadTeam& team);

}  // namespace opaline::render
