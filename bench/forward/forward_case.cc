#include "bench/forward/forward_case.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace opaline::bench {
namespace {

/// A smooth random field over the block's cells, stretched to [0, 1].
std::vector<double> smooth_field(const Block& block, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr double kShortest = 8.0;  // mm
  std::vector<double> field(block.cell_count(), 0.0);
  for (int wave = 0; wave < 24; ++wave) {
    std::array<double, 3> k{uniform(generator), uniform(generator), uniform(generator)};
    const double phase = std::numbers::pi * uniform(generator);
    for (double& component : k)
      component *= 2.0 * std::numbers::pi / (kShortest * std::numbers::sqrt3);
    std::size_t at = 0;
    for (int z = 0; z < block.nz; ++z)
      for (int y = 0; y < block.ny; ++y)
        for (int x = 0; x < block.nx; ++x)
          field[at++] +=
              std::cos(k[0] * x * block.hx + k[1] * y * block.hy + k[2] * z * block.hz + phase);
  }
  const auto [low, high] = std::minmax_element(field.begin(), field.end());
  const double from = *low;
  const double range = std::max(*high - *low, 1e-300);
  for (double& v : field) v = (v - from) / range;
  return field;
}

}  // namespace

ForwardCase make_forward_case(const std::string& name, int nx, int ny, int nz) {
  const Block block{nx, ny, nz, 0.5, 0.5, 0.5};
  ForwardCase made{name, {block, smooth_field(block, 1), smooth_field(block, 2), 2.34053}, {}};
  for (double& v : made.medium.diffusion) v = 0.1 * std::pow(10.0, v);
  for (double& v : made.medium.absorption) v = 0.001 * std::pow(100.0, v);
  made.b = {block.cell_count(), 16};
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      const std::size_t cell = block.index(x, y, 0);
      const double gb =
          1.0 / (2.0 * made.medium.boundary_a + block.hz / (2.0 * made.medium.diffusion[cell]));
      made.b.field(4 * y / ny * 4 + 4 * x / nx)[cell] = block.hx * block.hy * gb;
    }
  return made;
}

}  // namespace opaline::bench
