#pragma once

#include <array>
#include <vector>

#include "render/tetrahedra/bcc_lattice.h"
#include "render/tetrahedra/cut_lattice.h"

namespace opaline::render {

/// The tetrahedra inside the surface, as corners among CutLattice::points, in
/// either orientation: lattice tetrahedra as they are where none of their
/// corners is outside, else what the stencils of Labelle & Shewchuk (fig. 3)
/// leave of them.
///
/// Where two tetrahedra share a face with two corners u, v inside and w
/// outside, both must cut the quadrilateral (u, v, cut of vw, cut of uw) along
/// the same diagonal: from the cut of the one long edge among uw and vw; or,
/// where uv is the long edge, by the parity of its corners.
std::vector<std::array<int, 4>> apply_stencils(const BackgroundLattice& lattice,
                                               const CutLattice& cut);

}  // namespace opaline::render
