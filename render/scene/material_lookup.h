#pragma once

#include <array>

#include "base/material.h"
#include "render/scene/scene.h"

namespace opaline::render {

/// Coefficients of one place, 1/mm.
struct Coefficients {
  Colour absorption{};
  Colour reduced_scattering{};

  Coefficients& operator+=(const Coefficients& more) {
    for (int c = 0; c < 3; ++c) {
      absorption[c] += more.absorption[c];
      reduced_scattering[c] += more.reduced_scattering[c];
    }
    return *this;
  }
  friend Coefficients operator*(Coefficients a, double weight) {
    for (int c = 0; c < 3; ++c) {
      a.absorption[c] *= weight;
      a.reduced_scattering[c] *= weight;
    }
    return a;
  }
};

/// Trilinear between the centres of a block's cells, and beyond them by tiling along x, y, z; `place` in the block's frame, mm.
Coefficients looked_up(const Material& material, Vec3 place, const std::array<Tiling, 3>& tiling);

/// Where a coordinate beyond 0 to n - 1 is looked up, by tiling: a place between cell centres again.
double tiled(double coordinate, int cells, Tiling tiling);

}  // namespace opaline::render
