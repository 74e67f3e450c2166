#pragma once

#include <cstdint>
#include <stop_token>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "render/mesh/signed_distance.h"
#include "render/tetrahedra/bcc_lattice.h"
#include "render/tetrahedra/octree.h"

namespace opaline::render {

enum class Side : std::int8_t { kInside = -1, kSurface = 0, kOutside = 1 };

/// A lattice and where a solid's surface cuts it. Lattice points that were too
/// near to a cut have moved onto the surface: nearer than 0.24999 of a long
/// (axis-parallel) edge or 0.41189 of a short one (Labelle & Shewchuk, table
/// 1).
struct CutLattice {
  std::vector<Vec3> points;                     ///< of the lattice, moved or not; then the cuts
  std::vector<Side> sides;                      ///< of the lattice's points
  std::unordered_map<std::uint64_t, int> cuts;  ///< edge -> point, between points of opposite sides

  static std::uint64_t edge_key(int a, int b) {
    const auto low = static_cast<std::uint64_t>(std::min(a, b));
    return low << 32 | static_cast<std::uint64_t>(std::max(a, b));
  }
  int cut_of(int a, int b) const { return cuts.at(edge_key(a, b)); }

  /// Errors: kCancelled.
  static Result<CutLattice> create(const Octree& tree,
                                   const BackgroundLattice& lattice,
                                   const SignedDistance& solid,
                                   std::stop_token stop);
};

/// Whether an edge of the lattice runs along an axis.
inline bool is_long(LatticePoint a, LatticePoint b) {
  return (a.x != b.x) + (a.y != b.y) + (a.z != b.z) == 1;
}

}  // namespace opaline::render
