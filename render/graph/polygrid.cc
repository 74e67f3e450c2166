#include "render/graph/polygrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace opaline::render {
namespace {

constexpr std::array<Vec3, 6> kDirections{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

constexpr int kMostLevels = 6;
constexpr int kOutside = -1;
constexpr int kHalvings = 10;
constexpr double kSameSide = 0.7;  // cosine between normals

using Cell = std::array<long, 3>;

/// The places of a lattice around a solid, joined to cells of 2^level places a side.
class Lattice {
 public:
  Lattice(const Box& box, double spacing) : spacing_(spacing) {
    const Vec3 size = box.size();
    constexpr long kLargest = 1L << (kMostLevels - 1);
    const auto count = [spacing](double length) {  // cells of every size fit in
      const auto places = static_cast<long>(std::ceil(length / spacing)) + 2;
      return (places + kLargest - 1) / kLargest * kLargest;
    };
    counts_ = {count(size.x), count(size.y), count(size.z)};
    low_ = box.centre() -
           Vec3{double(counts_[0]), double(counts_[1]), double(counts_[2])} * (0.5 * spacing);
  }

  std::size_t places() const {
    return static_cast<std::size_t>(counts_[0]) * counts_[1] * counts_[2];
  }
  /// The centre of a cell that begins at a place.
  Vec3 centre(const Cell& first, long width) const {
    const double half = 0.5 * static_cast<double>(width);
    return low_ + Vec3{double(first[0]) + half, double(first[1]) + half, double(first[2]) + half} *
                      spacing_;
  }
  std::size_t index(const Cell& c) const {
    return static_cast<std::size_t>((c[2] * counts_[1] + c[1]) * counts_[0] + c[0]);
  }
  bool holds(const Cell& c) const {
    for (int a = 0; a < 3; ++a) {
      if (c[a] < 0 || c[a] >= counts_[a]) return false;
    }
    return true;
  }

  void find_inside(const SignedDistance& solid, const std::stop_token& stop) {
    level_.assign(places(), kOutside);
    each(1, stop, [&](const Cell& c) {
      if (solid.at(centre(c, 1)) < 0.0) level_[index(c)] = 0;
    });
  }

  /// Joins what may be 2^level places wide.
  void join(const SignedDistance& solid, double growth, int level, const std::stop_token& stop) {
    const long width = 1L << level;
    const std::vector<std::int16_t> before = level_;
    each(width, stop, [&](const Cell& first) {
      if (!whole(before, first, width, level - 1, level - 1)) return;
      const double depth = -solid.at(centre(first, width));
      if (static_cast<double>(width) * spacing_ > spacing_ + growth * depth) return;
      for (int k = 0; k < 6; ++k) {  // no neighbour less than half as large, nor the surface
        Cell beside = first;
        beside[k / 2] += k % 2 == 0 ? -width : width;
        if (!holds(beside) || !whole(before, beside, width, level - 1, kMostLevels)) return;
      }
      fill(level_, first, width, static_cast<std::int16_t>(level));
    });
  }

  void number_nodes(Polygrid& grid) {
    number_.assign(places(), -1);
    each(1, {}, [&](const Cell& first) {
      if (level_[index(first)] < 0 || number_[index(first)] >= 0) return;
      const long width = 1L << level_[index(first)];
      fill(number_, first, width, static_cast<int>(grid.inner.size()));
      grid.inner.push_back(centre(first, width));
      const double side = spacing_ * static_cast<double>(width);
      grid.volumes.push_back(side * side * side);
      firsts_.push_back(first);
    });
  }

  void link(Polygrid& grid, std::size_t node) const {
    const Cell& first = firsts_[node];
    const long width = 1L << level_[index(first)];
    const double side = spacing_ * static_cast<double>(width);
    for (int k = 0; k < 6; ++k) {
      Cell beside = first;
      beside[k / 2] += k % 2 == 0 ? -1 : width;
      const int next = level_[index(beside)];  // the lattice's rim is outside the solid
      const bool smaller = next >= 0 && (1L << next) < width;
      const long parts = smaller ? 2 : 1;
      for (long u = 0; u < parts; ++u) {
        for (long v = 0; v < parts; ++v) {
          Cell at = beside;
          at[(k / 2 + 1) % 3] += u * width / 2;
          at[(k / 2 + 2) % 3] += v * width / 2;
          const double area = side * side / static_cast<double>(parts * parts);
          const int other = number_[index(at)];
          const double length =
              other >= 0 ? opaline::length(grid.inner[other] - grid.inner[node]) : side;
          grid.links[node].push_back({other, -1, area, 0.5 * side, length});
        }
      }
    }
  }

 private:
  /// Cells of `width` places, x fastest.
  template <class Visit>
  void each(long width, const std::stop_token& stop, const Visit& visit) const {
    for (long k = 0; k < counts_[2] && !stop.stop_requested(); k += width) {
      for (long j = 0; j < counts_[1]; j += width) {
        for (long i = 0; i < counts_[0]; i += width) visit(Cell{i, j, k});
      }
    }
  }

  /// Whether all places of a cell have a level from `least` to `most`.
  bool whole(const std::vector<std::int16_t>& levels,
             const Cell& first,
             long width,
             int least,
             int most) const {
    for (long k = 0; k < width; ++k) {
      for (long j = 0; j < width; ++j) {
        for (long i = 0; i < width; ++i) {
          const int level = levels[index({first[0] + i, first[1] + j, first[2] + k})];
          if (level < least || level > most) return false;
        }
      }
    }
    return true;
  }

  template <class T>
  void fill(std::vector<T>& values, const Cell& first, long width, T value) const {
    for (long k = 0; k < width; ++k) {
      for (long j = 0; j < width; ++j) {
        for (long i = 0; i < width; ++i)
          values[index({first[0] + i, first[1] + j, first[2] + k})] = value;
      }
    }
  }

  double spacing_;
  Vec3 low_;
  Cell counts_{};
  std::vector<std::int16_t> level_;  // of each place, of the cell it is in
  std::vector<int> number_;          // the node of each place
  std::vector<Cell> firsts_;         // of each node
};

/// What the open faces of a node see of one side of the surface.
struct Side {
  Vec3 hit;  // of its first face's perpendicular
  Vec3 normal;
  std::vector<int> faces;
};

/// Where the surface is met from `inside` towards `direction`, within `reach`.
Vec3 hit_of(const SignedDistance& solid, Vec3 inside, Vec3 direction, double reach) {
  double low = 0.0;
  double high = reach;
  for (int halvings = 0; halvings < kHalvings; ++halvings) {
    const double middle = 0.5 * (low + high);
    (solid.at(inside + direction * middle) < 0.0 ? low : high) = middle;
  }
  return inside + direction * (0.5 * (low + high));
}

std::vector<Side> sides_of(const SignedDistance& solid, const Polygrid& grid, std::size_t node) {
  std::vector<Side> sides;
  for (int k = 0; k < 6; ++k) {
    if (grid.links[node][k].inner >= 0) continue;
    const Vec3 hit = hit_of(solid, grid.inner[node], kDirections[k], grid.spacing);
    const Vec3 normal = solid.normal(hit, 0.01 * grid.spacing);
    const auto same = std::ranges::find_if(
        sides, [&](const Side& side) { return dot(side.normal, normal) > kSameSide; });
    if (same != sides.end())
      same->faces.push_back(k);
    else
      sides.push_back({hit, normal, {k}});
  }
  return sides;
}

void link_side(const Side& side, Vec3 normal, double depth, Polygrid& grid, std::size_t node) {
  double area = 0.0;
  int widest = side.faces.front();
  double width = 0.0;
  for (const int k : side.faces) {
    const double share = std::max(0.0, dot(normal, kDirections[k]));
    area += grid.spacing * grid.spacing * share;
    if (share <= width) continue;
    width = share;
    widest = k;
  }
  if (area == 0.0) return;
  const auto surface = static_cast<int>(grid.surface.size());
  grid.links[node][widest] = {-1, surface, area, depth, depth};
  grid.surface.push_back(
      {grid.inner[node] + normal * depth, normal, static_cast<int>(node), area, depth, depth});
}

void link_surface(const SignedDistance& solid, Polygrid& grid, std::size_t node) {
  const Vec3 place = grid.inner[node];
  const std::vector<Side> sides = sides_of(solid, grid, node);
  if (sides.size() == 1) {
    link_side(sides.front(),
              solid.normal(place, 0.01 * grid.spacing),
              std::abs(solid.at(place)),
              grid,
              node);
    return;
  }
  for (const Side& side : sides)
    link_side(side, side.normal, std::max(0.0, dot(side.hit - place, side.normal)), grid, node);
}

}  // namespace

Result<Polygrid> make_polygrid(const SignedDistance& solid,
                               double spacing_mm,
                               double interior_growth,
                               std::stop_token stop) {
  if (!(spacing_mm > 0.0) || !std::isfinite(spacing_mm)) {
    return invalid_argument(fmt::format("a spacing of {} mm; expected > 0", spacing_mm));
  }
  if (!(interior_growth >= 0.0)) {
    return invalid_argument(fmt::format("a growth of {}; expected at least 0", interior_growth));
  }
  const Vec3 size = solid.bounds().size();
  const double places =
      (size.x / spacing_mm + 3.0) * (size.y / spacing_mm + 3.0) * (size.z / spacing_mm + 3.0);
  if (!(places < static_cast<double>(kMostPolygridPlaces))) {
    return invalid_argument(
        fmt::format("a lattice of {:.3g} places; at most {}: choose a larger spacing",
                    places,
                    kMostPolygridPlaces));
  }
  Lattice lattice(solid.bounds(), spacing_mm);
  lattice.find_inside(solid, stop);
  for (int level = 1; level < kMostLevels && interior_growth > 0.0; ++level) {
    lattice.join(solid, interior_growth, level, stop);
  }
  if (stop.stop_requested()) return cancelled("building a polygrid");
  Polygrid grid{.spacing = spacing_mm, .inner = {}, .volumes = {}, .links = {}, .surface = {}};
  lattice.number_nodes(grid);
  if (grid.inner.empty()) {
    return invalid_argument(fmt::format(
        "no node of a lattice of {} mm lies in the solid: choose a smaller spacing", spacing_mm));
  }
  grid.links.resize(grid.inner.size());
  for (std::size_t node = 0; node < grid.inner.size(); ++node) {
    lattice.link(grid, node);
    const auto& links = grid.links[node];
    if (std::ranges::any_of(links, [](const auto& link) { return link.inner < 0; })) {
      link_surface(solid, grid, node);
    }
  }
  return grid;
}

}  // namespace opaline::render
