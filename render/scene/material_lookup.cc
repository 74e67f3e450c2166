#include "render/scene/material_lookup.h"

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

/// Where a coordinate beyond 0 to n - 1 is looked up: a place between cell centres again.
double tiled(double coordinate, int cells, Tiling tiling) {
  switch (tiling) {
    case Tiling::kClamp:
      return std::clamp(coordinate, 0.0, cells - 1.0);
    case Tiling::kRepeat:
      return coordinate - cells * std::floor((coordinate + 0.5) / cells);
    case Tiling::kMirror:
      break;
  }
  const double turn =
      coordinate + 0.5 - 2.0 * cells * std::floor((coordinate + 0.5) / (2.0 * cells));
  return (turn < cells ? turn : 2.0 * cells - turn) - 0.5;
}

}  // namespace

CellSpan span_at(double coordinate, int cells, Tiling tiling) {
  const double place = tiled(coordinate, cells, tiling);
  const int low = static_cast<int>(std::floor(place));
  const double share = place - low;
  if (tiling == Tiling::kRepeat) return {(low + cells) % cells, (low + 1 + cells) % cells, share};
  return {std::clamp(low, 0, cells - 1), std::clamp(low + 1, 0, cells - 1), share};
}

Coefficients looked_up(const Material& material, Vec3 place, const std::array<Tiling, 3>& tiling) {
  const Block& block = material.block;
  const std::array spans{span_at(place.x / block.hx - 0.5, block.nx, tiling[0]),
                         span_at(place.y / block.hy - 0.5, block.ny, tiling[1]),
                         span_at(place.z / block.hz - 0.5, block.nz, tiling[2])};
  Coefficients sum;
  for (int corner = 0; corner < 8; ++corner) {
    std::array<int, 3> cell{};
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool second = (corner >> axis & 1) != 0;
      cell[axis] = second ? spans[axis].high : spans[axis].low;
      weight *= second ? spans[axis].share : 1.0 - spans[axis].share;
    }
    const std::size_t index = block.index(cell[0], cell[1], cell[2]);
    for (int c = 0; c < 3; ++c) {
      sum.absorption[c] += weight * material.channels[c].absorption[index];
      sum.reduced_scattering[c] += weight * material.channels[c].reduced_scattering[index];
    }
  }
  return sum;
}

}  // namespace opaline::render
