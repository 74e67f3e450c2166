#include "render/edit/material_block.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr double kMostCells = 1 << 27;

}  // namespace

Result<Material> sampled_block(const Box& bounds,
                               double cell_mm,
                               double ior,
                               const std::function<Optics(Vec3)>& at) {
  const Vec3 size = bounds.size();
  const std::array counts{std::max(1.0, std::ceil(size.x / cell_mm)),
                          std::max(1.0, std::ceil(size.y / cell_mm)),
                          std::max(1.0, std::ceil(size.z / cell_mm))};
  if (!(counts[0] * counts[1] * counts[2] <= kMostCells)) {
    return invalid_argument(fmt::format(
        "a block of {:.3g} x {:.3g} x {:.3g} cells is too large", counts[0], counts[1], counts[2]));
  }
  Material material;
  material.ior = ior;
  Block& block = material.block;
  block.nx = static_cast<int>(counts[0]);
  block.ny = static_cast<int>(counts[1]);
  block.nz = static_cast<int>(counts[2]);
  block.hx = block.hy = block.hz = cell_mm;
  for (auto& channel : material.channels) {
    channel.absorption.reserve(block.cell_count());
    channel.reduced_scattering.reserve(block.cell_count());
  }
  for (int k = 0; k < block.nz; ++k) {
    for (int j = 0; j < block.ny; ++j) {
      for (int i = 0; i < block.nx; ++i) {
        const Optics optics =
            at(bounds.low + Vec3{(i + 0.5) * cell_mm, (j + 0.5) * cell_mm, (k + 0.5) * cell_mm});
        for (int c = 0; c < kColorChannels; ++c) {
          const double extinction = 1.0 / (3.0 * optics.diffusion[c]);
          material.channels[c].absorption.push_back(optics.absorption[c]);
          material.channels[c].reduced_scattering.push_back(
              std::max(1e-6, extinction - optics.absorption[c]));
        }
      }
    }
  }
  return material;
}

}  // namespace opaline::render
