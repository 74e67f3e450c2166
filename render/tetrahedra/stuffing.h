#pragma once

#include <cstddef>
#include <stop_token>

#include "base/result.h"
#include "render/mesh/signed_distance.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

struct StuffingOptions {
  double spacing_mm = 1.0;       ///< edge of the lattice's smallest cells, which hold
                                 ///< the surface; > 0
  double interior_growth = 0.0;  ///< the papers' K, 0 to 10: in depth d cells
                                 ///< may be spacing + K d long; 0: uniform
  std::size_t most_tets = 20'000'000;
};

/// Fills a solid with tetrahedra by isosurface stuffing (Labelle & Shewchuk,
/// Isosurface stuffing: fast tetrahedral meshes with good dihedral angles,
/// SIGGRAPH 2007): a body-centred lattice on an octree; lattice points nearer
/// than a share of an edge to where the surface cuts that edge move there; what
/// the surface still cuts is cut by stencils. Every point of the surface is a
/// root of the distance along an edge.
///
/// With K = 0 dihedral angles lie between 10.7 and 164.8 degrees (the paper's
/// proof); with K > 0 the tetrahedra between cells of different size are the
/// paper's graded ones, and quality_of() says how they came out.
///
/// About 12 (spacing)^-3 tetrahedra a cubic millimetre. What is thinner than
/// about one spacing is thinned out or lost: compare quality_of().volume.
/// Errors: kInvalidArgument for options that make no sense, more than
/// most_tets, or a solid of which nothing is left;
///         kCancelled.
Result<TetMesh> stuff(const SignedDistance& solid,
                      const StuffingOptions& options,
                      std::stop_token stop);

/// The spacing that cuts a solid into about so many tetrahedra with K = 0: (12
/// volume / tets)^(1/3).
double spacing_for(double volume_mm3, double tets);

/// The volume of a solid by counting points of a grid of about `points`; within
/// some percent.
double estimate_volume(const SignedDistance& solid, int points = 100'000);

}  // namespace opaline::render
