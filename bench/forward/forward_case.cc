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

std::optional<ForwardCase> make_forward_case(const std::string& name) {
  struct Size {
    const char* name;
    int nx, ny, nz;
  };
  for (const Size& size : {Size{"a64", 64, 64, 32},
                           Size{"wax1", 130, 53, 37},
                           Size{"marble", 256, 256, 20},
                           Size{"cube64", 64, 64, 64},
                           Size{"cube256", 256, 256, 256}}) {
    if (name == size.name) return make_forward_case(name, size.nx, size.ny, size.nz);
  }
  return std::nullopt;
}

double front_face_error(const ForwardCase& problem,
                        const reconstruct::diffusion::FieldBatch& x,
                        const reconstruct::diffusion::FieldBatch& exact) {
  const Block& block = problem.medium.block;
  double worst = 0.0;
  for (int m = 0; m < x.count; ++m) {
    double off = 0.0;
    double all = 0.0;
    for (std::size_t c = block.index(0, 0, block.nz - 1); c < block.cell_count(); ++c) {
      off += std::pow(x.field(m)[c] - exact.field(m)[c], 2);
      all += std::pow(exact.field(m)[c], 2);
    }
    worst = std::max(worst, std::sqrt(off / all));
  }
  return worst;
}

}  // namespace opaline::bench
