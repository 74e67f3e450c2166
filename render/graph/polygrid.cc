#include "render/graph/polygrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr std::array<Vec3, 6> kDirections{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

/// The places of a lattice around a solid, and which are nodes.
class Lattice {
 public:
  Lattice(const Box& box, double spacing) : spacing_(spacing) {
    const Vec3 size = box.size();
    const auto count = [spacing](double length) {
      return static_cast<long>(std::ceil(length / spacing)) + 2;
    };
    counts_ = {count(size.x), count(size.y), count(size.z)};
    low_ = box.centre() -
           Vec3{double(counts_[0]), double(counts_[1]), double(counts_[2])} * (0.5 * spacing);
  }

  std::size_t places() const {
    return static_cast<std::size_t>(counts_[0]) * counts_[1] * counts_[2];
  }
  Vec3 place(long i, long j, long k) const {
    return low_ + (Vec3{double(i), double(j), double(k)} + Vec3{0.5, 0.5, 0.5}) * spacing_;
  }
  std::size_t index(long i, long j, long k) const {
    return static_cast<std::size_t>((k * counts_[1] + j) * counts_[0] + i);
  }

  /// Numbers the places inside the solid; -1 for the others.
  std::vector<int> number_nodes(const SignedDistance& solid,
                                Polygrid& grid,
                                std::stop_token stop) const {
    std::vector<int> number(places(), -1);
    for (long k = 0; k < counts_[2] && !stop.stop_requested(); ++k) {
      for (long j = 0; j < counts_[1]; ++j) {
        for (long i = 0; i < counts_[0]; ++i) {
          const Vec3 p = place(i, j, k);
          if (solid.at(p) >= 0.0) continue;
          number[index(i, j, k)] = static_cast<int>(grid.inner.size());
          grid.inner.push_back(p);
        }
      }
    }
    return number;
  }

  std::array<int, 6> neighbours(Vec3 p, const std::vector<int>& number) const {
    std::array<int, 6> found{};
    for (int k = 0; k < 6; ++k) {
      const Vec3 cell = (p - low_) * (1.0 / spacing_) + kDirections[k];
      const auto at = [](double x) { return static_cast<long>(std::floor(x)); };
      found[k] = number[index(
          at(cell.x), at(cell.y), at(cell.z))];  // the lattice's rim is outside the solid
    }
    return found;
  }

 private:
  double spacing_;
  Vec3 low_;
  std::array<long, 3> counts_{};
};

void link_inside(Polygrid& grid, std::size_t node, const std::array<int, 6>& neighbours) {
  const double h = grid.spacing;
  for (int k = 0; k < 6; ++k) grid.links[node][k] = {neighbours[k], -1, h * h, 0.5 * h, h};
}

void link_surface(const SignedDistance& solid, Polygrid& grid, std::size_t node) {
  const double h = grid.spacing;
  const Vec3 place = grid.inner[node];
  const Vec3 normal = solid.normal(place, 0.01 * h);
  const double depth = std::abs(solid.at(place));
  double area = 0.0;
  int widest = -1;
  double width = 0.0;
  for (int k = 0; k < 6; ++k) {
    const double share = dot(normal, kDirections[k]);
    if (grid.links[node][k].inner >= 0 || share <= 0.0) continue;
    area += h * h * share;
    if (share <= width) continue;
    width = share;
    widest = k;
  }
  if (widest < 0) return;
  const auto surface = static_cast<int>(grid.surface.size());
  grid.links[node][widest] = {-1, surface, area, depth, depth};
  grid.surface.push_back(
      {place + normal * depth, normal, static_cast<int>(node), area, depth, depth});
}

}  // namespace

Result<Polygrid> make_polygrid(const SignedDistance& solid,
                               double spacing_mm,
                               std::stop_token stop) {
  if (!(spacing_mm > 0.0) || !std::isfinite(spacing_mm)) {
    return invalid_argument(fmt::format("a spacing of {} mm; expected > 0", spacing_mm));
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
  const Lattice lattice(solid.bounds(), spacing_mm);
  Polygrid grid{.spacing = spacing_mm, .inner = {}, .volumes = {}, .links = {}, .surface = {}};
  const std::vector<int> number = lattice.number_nodes(solid, grid, stop);
  if (stop.stop_requested()) return cancelled("building a polygrid");
  if (grid.inner.empty()) {
    return invalid_argument(fmt::format(
        "no node of a lattice of {} mm lies in the solid: choose a smaller spacing", spacing_mm));
  }
  grid.volumes.assign(grid.inner.size(), spacing_mm * spacing_mm * spacing_mm);
  grid.links.resize(grid.inner.size());
  for (std::size_t node = 0; node < grid.inner.size(); ++node) {
    const auto neighbours = lattice.neighbours(grid.inner[node], number);
    link_inside(grid, node, neighbours);
    if (std::ranges::min(neighbours) < 0) link_surface(solid, grid, node);
  }
  return grid;
}

}  // namespace opaline::render
