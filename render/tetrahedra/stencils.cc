#include "render/tetrahedra/stencils.h"

#include <algorithm>

namespace opaline::render {
namespace {

/// One tetrahedron's corners by side.
struct Corners {
  std::array<int, 4> inside{};
  std::array<int, 4> surface{};
  std::array<int, 4> outside{};
  int insides = 0;
  int surfaces = 0;
  int outsides = 0;
};

Corners sort_corners(const std::array<int, 4>& tet, const CutLattice& cut) {
  Corners corners;
  for (const int v : tet) {
    if (cut.sides[v] == Side::kInside) corners.inside[corners.insides++] = v;
    if (cut.sides[v] == Side::kSurface) corners.surface[corners.surfaces++] = v;
    if (cut.sides[v] == Side::kOutside) corners.outside[corners.outsides++] = v;
  }
  return corners;
}

class Stencils {
 public:
  Stencils(const BackgroundLattice& lattice, const CutLattice& cut)
      : lattice_(lattice), cut_(cut) {}

  void apply(const std::array<int, 4>& tet) {
    const Corners c = sort_corners(tet, cut_);
    if (c.insides == 0) return;
    if (c.outsides == 0) {
      tets_.push_back(tet);
    } else if (c.insides == 1) {
      apply_one_inside(c);
    } else if (c.insides == 3) {
      const int d = c.outside[0];
      add_prism(
          {c.inside[0], c.inside[1], c.inside[2]},
          {cut_.cut_of(c.inside[0], d), cut_.cut_of(c.inside[1], d), cut_.cut_of(c.inside[2], d)},
          {starts_at(c.inside[0], c.inside[1], d),
           starts_at(c.inside[1], c.inside[2], d),
           starts_at(c.inside[2], c.inside[0], d)});
    } else if (c.outsides == 1) {
      apply_pyramid(c.inside[0], c.inside[1], c.surface[0], c.outside[0]);
    } else {
      apply_wedge(c.inside[0], c.inside[1], c.outside[0], c.outside[1]);
    }
  }

  std::vector<std::array<int, 4>> take() { return std::move(tets_); }

 private:
  void apply_one_inside(const Corners& c) {
    std::array<int, 4> tet{c.inside[0]};
    int n = 1;
    for (int k = 0; k < c.surfaces; ++k) tet[n++] = c.surface[k];
    for (int k = 0; k < c.outsides; ++k) tet[n++] = cut_.cut_of(c.inside[0], c.outside[k]);
    tets_.push_back(tet);
  }

  /// u, v inside, s on the surface, w outside.
  void apply_pyramid(int u, int v, int s, int w) {
    const int uw = cut_.cut_of(u, w);
    const int vw = cut_.cut_of(v, w);
    if (starts_at(u, v, w)) {
      tets_.push_back({s, u, v, vw});
      tets_.push_back({s, u, vw, uw});
    } else {
      tets_.push_back({s, v, u, uw});
      tets_.push_back({s, v, uw, vw});
    }
  }

  /// u, v inside, w, x outside: a prism between (u, uw, ux) and (v, vw, vx),
  /// whose third side lies on the surface.
  void apply_wedge(int u, int v, int w, int x) {
    const bool first = starts_at(u, v, w);
    const bool last = starts_at(v, u, x);
    const std::array<int, 3> p{u, cut_.cut_of(u, w), cut_.cut_of(u, x)};
    const std::array<int, 3> q{v, cut_.cut_of(v, w), cut_.cut_of(v, x)};
    add_prism(p, q, {first, is_free_from(p, q, first, last), last});
  }

  /// The diagonal on the surface, from p1 to q2 rather than from p2 to q1: the
  /// shorter, unless that made all three alike.
  bool is_free_from(const std::array<int, 3>& p,
                    const std::array<int, 3>& q,
                    bool first,
                    bool last) const {
    if (first == last) return !first;
    return length(cut_.points[p[1]] - cut_.points[q[2]]) <
           length(cut_.points[p[2]] - cut_.points[q[1]]);
  }

  /// Whether the quadrilateral of u, v inside and w outside is cut from u (to
  /// the cut of vw) rather than from v.
  bool starts_at(int u, int v, int w) const {
    const LatticePoint pu = lattice_.points[u];
    const LatticePoint pv = lattice_.points[v];
    const LatticePoint pw = lattice_.points[w];
    if (is_long(pu, pv)) return is_even(pu) != is_even(pv) ? is_even(pu) : u < v;
    if (is_long(pu, pw) != is_long(pv, pw)) return is_long(pv, pw);
    return u < v;
  }

  static bool is_even(LatticePoint p) { return ((p.x >> 1) + (p.y >> 1) + (p.z >> 1)) % 2 == 0; }

  /// A prism of triangles p and q; diagonal k runs from p[k] to q[k + 1] where
  /// from[k], else from p[k + 1] to q[k]. Not all alike.
  void add_prism(const std::array<int, 3>& p,
                 const std::array<int, 3>& q,
                 const std::array<bool, 3>& from) {
    for (int k = 0; k < 3; ++k) {  // the corner of p where two diagonals start
      const int next = (k + 1) % 3;
      const int last = (k + 2) % 3;
      if (!from[k] || from[last]) continue;
      tets_.push_back({p[k], q[k], q[next], q[last]});
      if (from[next]) {
        tets_.push_back({p[k], p[next], q[last], q[next]});
        tets_.push_back({p[k], p[next], p[last], q[last]});
      } else {
        tets_.push_back({p[k], p[next], p[last], q[next]});
        tets_.push_back({p[k], p[last], q[last], q[next]});
      }
      return;
    }
  }

  const BackgroundLattice& lattice_;
  const CutLattice& cut_;
  std::vector<std::array<int, 4>> tets_;
};

}  // namespace

std::vector<std::array<int, 4>> apply_stencils(const BackgroundLattice& lattice,
                                               const CutLattice& cut) {
  Stencils stencils(lattice, cut);
  for (const auto& tet : lattice.tets) stencils.apply(tet);
  return stencils.take();
}

}  // namespace opaline::render
