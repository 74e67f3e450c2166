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

/// What each of the three views of a block, along x, y and z, counts where a surface has this normal: fourth powers. Not
/// scaled to 1.
inline std::array<double, 3> view_weights(Vec3 normal) {
  const auto fourth = [](double x) { return x * x * x * x; };
  return {fourth(normal.x), fourth(normal.y), fourth(normal.z)};
}

/// Trilinear between the centres of a block's cells, and beyond them by tiling along x, y, z; `place` in the block's frame, mm.
Coefficients looked_up(const Material& material, Vec3 place, const std::array<Tiling, 3>& tiling);

/// The two cells around a coordinate in cells, 0 the middle of the first, and the share of the second.
struct CellSpan {
  int low = 0;
  int high = 0;
  double share = 0.0;
};
CellSpan span_at(double coordinate, int cells, Tiling tiling);

}  // namespace opaline::render
