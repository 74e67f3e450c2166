#pragma once

#include <array>
#include <cstdint>
#include <stop_token>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "render/mesh/signed_distance.h"

namespace opaline::render {

/// A place on the lattice, in half the edges of the smallest cells: corners of
/// cells are even, centres of the smallest ones odd.
struct LatticePoint {
  int x = 0;
  int y = 0;
  int z = 0;
  bool operator==(const LatticePoint&) const = default;
  int operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};
inline LatticePoint operator+(LatticePoint a, LatticePoint b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline LatticePoint operator*(LatticePoint a, int s) { return {a.x * s, a.y * s, a.z * s}; }

/// A cell without children: its lowest corner and its edge, both in half the
/// smallest edges.
struct OctreeCell {
  LatticePoint corner;
  int edge = 2;
  LatticePoint centre() const {
    return {corner.x + edge / 2, corner.y + edge / 2, corner.z + edge / 2};
  }
};

struct OctreeOptions {
  double spacing_mm = 1.0;       ///< edge of the smallest cells, which hold the whole surface
  double interior_growth = 0.0;  ///< K >= 0: in depth d a cell's edge may be spacing + K d
  std::size_t most_cells = 5'000'000;
};

/// The cells that a solid touches, smallest at the surface, growing inwards, no
/// two that share an edge more than twice as long as one another (the weak
/// balance of Labelle & Shewchuk, Isosurface stuffing, 2007, sec. 3.1). Around
/// the surface at least one layer of smallest cells lies on both sides; what is
/// further out is left away.
class Octree {
 public:
  /// Errors: kInvalidArgument for options that make no sense, or more than
  /// most_cells; kCancelled.
  static Result<Octree> create(const SignedDistance& solid,
                               const OctreeOptions& options,
                               std::stop_token stop);

  const std::vector<OctreeCell>& cells() const {
    return cells_;
  }  ///< along a space-filling curve (Morton)
  double spacing() const { return spacing_; }
  Vec3 place(LatticePoint p) const {
    return origin_ + Vec3{double(p.x), double(p.y), double(p.z)} * (0.5 * spacing_);
  }

  bool has_cell(LatticePoint corner, int edge) const;
  /// Whether a place is the corner of some cell.
  bool is_corner(LatticePoint p) const { return corners_.contains(key(p)); }

  static std::uint64_t key(LatticePoint p);

 private:
  void refine(const SignedDistance& solid,
              const OctreeOptions& options,
              OctreeCell cell,
              std::stop_token stop);
  void balance();
  void split(OctreeCell cell, std::vector<OctreeCell>& pending);
  void finish();

  Vec3 origin_;
  double spacing_ = 1.0;
  std::vector<OctreeCell> cells_;
  std::unordered_map<std::uint64_t, int> edges_;  // corner of a cell -> its edge
  std::unordered_map<std::uint64_t, char> corners_;
  std::size_t most_cells_ = 0;
  bool too_many_ = false;
};

}  // namespace opaline::render
