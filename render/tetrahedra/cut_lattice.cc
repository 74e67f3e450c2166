#include "render/tetrahedra/cut_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::render {
namespace {

constexpr double kAlphaLong = 0.24999;
constexpr double kAlphaShort = 0.41189;
constexpr int kRootSteps = 12;

struct CutEdge {
  int a = 0;           // inside
  int b = 0;           // outside
  double share = 0.5;  // of the way from a to b
};

Side side_of(double distance) {
  if (distance < 0.0) return Side::kInside;
  return distance > 0.0 ? Side::kOutside : Side::kSurface;
}

/// Where the distance vanishes between two points of opposite sign: regula
/// falsi, the kept end's value halved (Illinois).
double find_root(const SignedDistance& solid, Vec3 a, Vec3 b, double at_a, double at_b) {
  const double goal = 1e-7 * length(b - a);
  double low = 0.0;
  double high = 1.0;
  double share = 0.5;
  int kept = 0;
  for (int i = 0; i < kRootSteps; ++i) {
    share = (low * at_b - high * at_a) / (at_b - at_a);
    const double value = solid.at(a + (b - a) * share);
    if (std::abs(value) <= goal) break;
    if (value < 0.0) {
      low = share;
      at_a = value;
      if (kept == 1) at_b *= 0.5;
      kept = 1;
    } else {
      high = share;
      at_b = value;
      if (kept == -1) at_a *= 0.5;
      kept = -1;
    }
  }
  return share;
}

std::vector<std::uint64_t> crossing_edges(const BackgroundLattice& lattice,
                                          const std::vector<Side>& sides) {
  std::vector<std::uint64_t> edges;
  for (const auto& tet : lattice.tets) {
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < i; ++k) {
        const bool crosses = static_cast<int>(sides[tet[i]]) * static_cast<int>(sides[tet[k]]) < 0;
        if (crosses) edges.push_back(CutLattice::edge_key(tet[i], tet[k]));
      }
    }
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

/// One lattice and its cuts while points move.
class Warping {
 public:
  Warping(const Octree& tree, const BackgroundLattice& lattice, const SignedDistance& solid)
      : tree_(tree), lattice_(lattice), solid_(solid) {
    for (const LatticePoint& p : lattice.points) cut_.points.push_back(tree.place(p));
  }

  void measure(std::stop_token stop) {
    for (std::size_t i = 0; i < cut_.points.size() && !stop.stop_requested(); ++i) {
      distances_.push_back(solid_.at(cut_.points[i]));
      cut_.sides.push_back(side_of(distances_.back()));
    }
  }

  void find_cuts(std::stop_token stop) {
    for (const std::uint64_t key : crossing_edges(lattice_, cut_.sides)) {
      if (stop.stop_requested()) return;
      auto a = static_cast<int>(key >> 32);
      auto b = static_cast<int>(key & 0xffffffffU);
      if (cut_.sides[a] == Side::kOutside) std::swap(a, b);
      edges_.push_back(
          {a, b, find_root(solid_, cut_.points[a], cut_.points[b], distances_[a], distances_[b])});
    }
  }

  void move_points() {
    const std::vector<std::vector<int>> edges_of = incidence();
    const std::vector<Vec3> before = cut_.points;
    for (std::size_t v = 0; v < edges_of.size(); ++v) {
      double nearest = 1.0;
      for (const int e : edges_of[v]) {
        const CutEdge& edge = edges_[e];
        if (cut_.sides[edge.a] == Side::kSurface || cut_.sides[edge.b] == Side::kSurface) continue;
        const bool from_a = edge.a == static_cast<int>(v);
        const double share = from_a ? edge.share : 1.0 - edge.share;
        const Vec3 along = before[from_a ? edge.b : edge.a] - before[v];
        const double distance = share * length(along) / tree_.spacing();
        if (share >= alpha(edge) || distance >= nearest) continue;
        nearest = distance;
        cut_.points[v] = before[v] + along * share;
      }
      if (nearest < 1.0) cut_.sides[v] = Side::kSurface;
    }
    add_cuts(before);
  }

  CutLattice take() { return std::move(cut_); }

 private:
  double alpha(const CutEdge& edge) const {
    return is_long(lattice_.points[edge.a], lattice_.points[edge.b]) ? kAlphaLong : kAlphaShort;
  }

  std::vector<std::vector<int>> incidence() const {
    std::vector<std::vector<int>> edges_of(lattice_.points.size());
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      edges_of[edges_[e].a].push_back(static_cast<int>(e));
      edges_of[edges_[e].b].push_back(static_cast<int>(e));
    }
    return edges_of;
  }

  void add_cuts(const std::vector<Vec3>& before) {
    for (const CutEdge& edge : edges_) {
      if (cut_.sides[edge.a] == Side::kSurface || cut_.sides[edge.b] == Side::kSurface) continue;
      cut_.cuts.emplace(CutLattice::edge_key(edge.a, edge.b), static_cast<int>(cut_.points.size()));
      cut_.points.push_back(before[edge.a] + (before[edge.b] - before[edge.a]) * edge.share);
    }
  }

  const Octree& tree_;
  const BackgroundLattice& lattice_;
  const SignedDistance& solid_;
  CutLattice cut_;
  std::vector<double> distances_;
  std::vector<CutEdge> edges_;
};

}  // namespace

Result<CutLattice> CutLattice::create(const Octree& tree,
                                      const BackgroundLattice& lattice,
                                      const SignedDistance& solid,
                                      std::stop_token stop) {
  Warping warping(tree, lattice, solid);
  warping.measure(stop);
  if (!stop.stop_requested()) warping.find_cuts(stop);
  if (stop.stop_requested()) return cancelled("cutting a solid into tetrahedra");
  warping.move_points();
  return warping.take();
}

}  // namespace opaline::render
