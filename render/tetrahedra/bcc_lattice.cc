#include "render/tetrahedra/bcc_lattice.h"

#include <cstdint>
#include <unordered_map>

namespace opaline::render {
namespace {

class Filler {
 public:
  explicit Filler(const Octree& tree) : tree_(tree) {
    numbers_.reserve(3 * tree.cells().size());
    lattice_.tets.reserve(12 * tree.cells().size());
  }

  BackgroundLattice fill() {
    for (const OctreeCell& cell : tree_.cells()) {
      for (int side = 0; side < 6; ++side) fill_side(cell, side / 2, side % 2);
    }
    return std::move(lattice_);
  }

 private:
  /// The corners of a face, once around.
  static std::array<LatticePoint, 4> face_corners(const OctreeCell& cell, int axis, int high) {
    const LatticePoint along[3]{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const LatticePoint u = along[(axis + 1) % 3] * cell.edge;
    const LatticePoint v = along[(axis + 2) % 3] * cell.edge;
    const LatticePoint base = cell.corner + along[axis] * (high * cell.edge);
    return {base, base + u, base + u + v, base + v};
  }

  static LatticePoint middle(LatticePoint a, LatticePoint b) {
    return {(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
  }

  void fill_side(const OctreeCell& cell, int axis, int high) {
    const LatticePoint along[3]{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const auto corners = face_corners(cell, axis, high);
    const LatticePoint beyond = cell.corner + along[axis] * ((2 * high - 1) * cell.edge);
    if (tree_.has_cell(beyond, cell.edge)) {
      if (high == 1) fill_between(cell.centre(), OctreeCell{beyond, cell.edge}.centre(), corners);
      return;
    }
    if (cell.edge > 2 && has_smaller(beyond, cell, axis, high))
      return fill_quarters(cell.centre(), corners);
    const int larger = 2 * cell.edge;
    const LatticePoint corner{beyond.x & -larger, beyond.y & -larger, beyond.z & -larger};
    if (beyond.x >= 0 && beyond.y >= 0 && beyond.z >= 0 && tree_.has_cell(corner, larger)) {
      fill_pyramid(cell.centre(), corners, {corner, larger}, axis, high);
    }
  }

  bool has_smaller(LatticePoint beyond, const OctreeCell& cell, int axis, int high) const {
    const LatticePoint along[3]{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    return tree_.has_cell(beyond + along[axis] * ((1 - high) * cell.edge / 2), cell.edge / 2);
  }

  void fill_between(LatticePoint c, LatticePoint d, const std::array<LatticePoint, 4>& corners) {
    for (int k = 0; k < 4; ++k) {
      const LatticePoint a = corners[k];
      const LatticePoint b = corners[(k + 1) % 4];
      const LatticePoint m = middle(a, b);
      if (is_split(a, b)) {
        add(c, d, a, m);
        add(c, d, m, b);
      } else {
        add(c, d, a, b);
      }
    }
  }

  void fill_quarters(LatticePoint c, const std::array<LatticePoint, 4>& corners) {
    const LatticePoint f = middle(corners[0], corners[2]);
    for (int k = 0; k < 4; ++k) {
      const LatticePoint m = middle(corners[k], corners[(k + 1) % 4]);
      add(c, f, corners[k], m);
      add(c, f, m, corners[(k + 1) % 4]);
    }
  }

  void fill_pyramid(LatticePoint c,
                    const std::array<LatticePoint, 4>& corners,
                    const OctreeCell& larger,
                    int axis,
                    int high) {
    const auto around = face_corners(larger, axis, 1 - high);
    const LatticePoint f = middle(around[0], around[2]);
    for (int k = 0; k < 4; ++k) {
      if (!(corners[k] == f)) continue;
      add(c, f, corners[(k + 1) % 4], corners[(k + 2) % 4]);
      add(c, f, corners[(k + 2) % 4], corners[(k + 3) % 4]);
    }
  }

  bool is_split(LatticePoint a, LatticePoint b) const {
    const int length = b.x - a.x + b.y - a.y + b.z - a.z;
    return length != 2 && length != -2 && tree_.is_corner(middle(a, b));
  }

  int number(LatticePoint p) {
    const auto [found, fresh] =
        numbers_.try_emplace(Octree::key(p), static_cast<int>(lattice_.points.size()));
    if (fresh) lattice_.points.push_back(p);
    return found->second;
  }

  void add(LatticePoint a, LatticePoint b, LatticePoint c, LatticePoint d) {
    lattice_.tets.push_back({number(a), number(b), number(c), number(d)});
  }

  const Octree& tree_;
  BackgroundLattice lattice_;
  std::unordered_map<std::uint64_t, int> numbers_;
};

}  // namespace

BackgroundLattice fill(const Octree& tree) { return Filler(tree).fill(); }

}  // namespace opaline::render
