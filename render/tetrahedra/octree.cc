#include "render/tetrahedra/octree.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

constexpr int kLargestExtent = 1 << 20;  // in half cells: the key has 21 bits an axis
constexpr double kLayers = 1.2;          // smallest cells around the surface, in edges

std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

LatticePoint child_corner(const OctreeCell& cell, int child) {
  const int half = cell.edge / 2;
  return cell.corner + LatticePoint{child & 1, child >> 1 & 1, child >> 2} * half;
}

LatticePoint aligned(LatticePoint p, int edge) { return {p.x & -edge, p.y & -edge, p.z & -edge}; }

bool is_inside(LatticePoint p) { return p.x >= 0 && p.y >= 0 && p.z >= 0; }

Result<void> check(const SignedDistance& solid, const OctreeOptions& options) {
  if (!(options.spacing_mm > 0.0) || !std::isfinite(options.spacing_mm)) {
    return invalid_argument(fmt::format("a spacing of {} mm; expected > 0", options.spacing_mm));
  }
  if (!(options.interior_growth >= 0.0) || options.interior_growth > 10.0) {
    return invalid_argument(fmt::format("K = {}; expected 0 to 10", options.interior_growth));
  }
  const Vec3 size = solid.bounds().size();
  const double cells = std::max({size.x, size.y, size.z}) / options.spacing_mm;
  if (!(cells < 0.125 * kLargestExtent)) {
    return invalid_argument(
        fmt::format("a solid {:.4g} mm long in cells of {} mm: choose a larger spacing",
                    std::max({size.x, size.y, size.z}),
                    options.spacing_mm));
  }
  return ok();
}

}  // namespace

std::uint64_t Octree::key(LatticePoint p) {
  return spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2;
}

bool Octree::has_cell(LatticePoint corner, int edge) const {
  if (!is_inside(corner)) return false;
  const auto found = edges_.find(key(corner));
  return found != edges_.end() && found->second == edge;
}

void Octree::refine(const SignedDistance& solid,
                    const OctreeOptions& options,
                    OctreeCell cell,
                    std::stop_token stop) {
  if (too_many_ || stop.stop_requested()) return;
  const double distance =
      solid.at(place(cell.corner) + Vec3{1.0, 1.0, 1.0} * (0.25 * cell.edge * spacing_));
  const double edge = 0.5 * cell.edge * spacing_;
  const double reach = 0.5 * std::numbers::sqrt3 * edge;
  if (distance > reach + kLayers * spacing_) return;
  const bool near_surface = std::abs(distance) < reach + kLayers * spacing_;
  const bool too_large =
      edge > spacing_ * 1.0001 + options.interior_growth * std::max(-distance, 0.0);
  if (cell.edge > 2 && (near_surface || too_large)) {
    for (int child = 0; child < 8; ++child) {
      refine(solid, options, {child_corner(cell, child), cell.edge / 2}, stop);
    }
    return;
  }
  edges_.emplace(key(cell.corner), cell.edge);
  too_many_ = edges_.size() > most_cells_;
}

void Octree::split(OctreeCell cell, std::vector<OctreeCell>& pending) {
  edges_.erase(key(cell.corner));
  for (int child = 0; child < 8; ++child) {
    const OctreeCell part{child_corner(cell, child), cell.edge / 2};
    edges_[key(part.corner)] = part.edge;
    pending.push_back(part);
  }
}

void Octree::balance() {
  std::vector<OctreeCell> pending = cells_;
  while (!pending.empty()) {
    const OctreeCell cell = pending.back();
    pending.pop_back();
    if (!has_cell(cell.corner, cell.edge)) continue;  // split meanwhile
    for (int n = 0; n < 27; ++n) {
      const LatticePoint step{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      if (step.x != 0 && step.y != 0 && step.z != 0) continue;  // shares no edge
      const LatticePoint at = cell.corner + step * cell.edge;
      if (!is_inside(at)) continue;
      for (int edge = 4 * cell.edge; edge <= kLargestExtent; edge *= 2) {
        if (!has_cell(aligned(at, edge), edge)) continue;
        split({aligned(at, edge), edge}, pending);
        pending.push_back(cell);
        break;
      }
    }
  }
}

void Octree::finish() {
  cells_.clear();
  cells_.reserve(edges_.size());
  std::vector<std::pair<std::uint64_t, int>> sorted(edges_.begin(), edges_.end());
  std::ranges::sort(sorted);
  const auto gather = [](std::uint64_t bits) {
    int value = 0;
    for (int b = 0; b < 21; ++b) value |= static_cast<int>(bits >> (3 * b) & 1U) << b;
    return value;
  };
  for (const auto& [code, edge] : sorted) {
    cells_.push_back({{gather(code), gather(code >> 1), gather(code >> 2)}, edge});
  }
}

Result<Octree> Octree::create(const SignedDistance& solid,
                              const OctreeOptions& options,
                              std::stop_token stop) {
  if (auto checked = check(solid, options); !checked) return checked.error();
  Octree tree;
  tree.spacing_ = options.spacing_mm;
  tree.most_cells_ = options.most_cells;
  const Vec3 size = solid.bounds().size();
  const double margin = 4.0 * options.spacing_mm;
  const double extent = std::max({size.x, size.y, size.z}) + 2.0 * margin;
  int edge = 2;
  while (0.5 * edge * options.spacing_mm < extent) edge *= 2;
  tree.origin_ = solid.bounds().centre() - Vec3{1.0, 1.0, 1.0} * (0.25 * edge * options.spacing_mm);
  tree.refine(solid, options, {{}, edge}, stop);
  if (stop.stop_requested()) return cancelled("cutting a solid into cells");
  if (tree.too_many_) {
    return invalid_argument(fmt::format("more than {} cells of {} mm: choose a larger spacing",
                                        options.most_cells,
                                        options.spacing_mm));
  }
  tree.finish();
  tree.balance();
  tree.finish();
  for (const OctreeCell& cell : tree.cells_) {
    for (int c = 0; c < 8; ++c) {
      tree.corners_.emplace(key(cell.corner + LatticePoint{c & 1, c >> 1 & 1, c >> 2} * cell.edge),
                            1);
    }
  }
  return tree;
}

}  // namespace opaline::render
