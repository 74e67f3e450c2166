#pragma once

#include <array>
#include <vector>

#include "render/tetrahedra/octree.h"

namespace opaline::render {

/// Tetrahedra that fill an octree's cells and meet face to face.
struct BackgroundLattice {
  std::vector<LatticePoint> points;
  std::vector<std::array<int, 4>> tets;
};

/// The background grid of Labelle & Shewchuk, Isosurface stuffing, 2007,
/// sec. 3.2. Over each face of a cell:
///
///   another cell of its size   four tetrahedra between the two centres and the
///   face's four edges, halved where an
///                              edge has a vertex in its middle (BCC, bisected
///                              BCC)
///   four smaller cells         eight between the centre and the face's eight
///   parts (quadrisected BCC) a larger cell              two between the centre
///   and the halves of the face, cut from the middle of the larger
///                              face (half pyramids)
///   nothing                    none
BackgroundLattice fill(const Octree& tree);

}  // namespace opaline::render
