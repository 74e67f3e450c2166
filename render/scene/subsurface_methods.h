#pragma once

#include "base/thread_team.h"
#include "reconstruct/diffusion/boundary.h"
#include "render/graph/polygrid.h"
#include "render/scene/subsurface.h"

namespace opaline::render {

/// What every method needs beside its tetrahedra. All of it must outlive the call, the team what is made.
struct SubsurfaceSetting {
  const SignedDistance& solid;
  const Subsurface::MaterialAt& material;
  const reconstruct::diffusion::Boundary& boundary;
  double ior;
  const DiffusionOptions& options;
  ThreadTeam& team;
};

/// Linear finite elements in double precision (render/graph/finite_elements.h). Errors, here and below: see
/// Subsurface::create().
Result<std::unique_ptr<Subsurface>> make_elements_subsurface(TetMesh mesh,
                                                             const SubsurfaceSetting& setting);

/// Two-point volumes on the QuadGraph of the tetrahedra (render/graph/two_point.h), single precision unless the tolerance asks
/// for more.
Result<std::unique_ptr<Subsurface>> make_graph_subsurface(TetMesh mesh,
                                                          const SubsurfaceSetting& setting);

/// The same on a lattice; the tetrahedra are what it is seen on.
Result<std::unique_ptr<Subsurface>> make_polygrid_subsurface(Polygrid grid,
                                                             TetMesh mesh,
                                                             const SubsurfaceSetting& setting);

}  // namespace opaline::render
