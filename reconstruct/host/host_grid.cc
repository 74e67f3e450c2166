#include "reconstruct/host/host_grid.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace opaline::reconstruct::host {
namespace {

using diffusion::Level;
using diffusion::Medium;

std::vector<double> with_y_and_z_exchanged(const Block& block, const std::vector<double>& values) {
  std::vector<double> exchanged(values.size());
  double* to = exchanged.data();
  for (int j = 0; j < block.ny; ++j)
    for (int k = 0; k < block.nz; ++k)
      to = std::copy_n(values.data() + block.index(0, j, k), block.nx, to);
  return exchanged;
}

Medium with_y_and_z_exchanged(const Medium& medium) {
  const Block& b = medium.block;
  return {{b.nx, b.nz, b.ny, b.hx, b.hz, b.hy},
          with_y_and_z_exchanged(b, medium.diffusion),
          with_y_and_z_exchanged(b, medium.absorption),
          medium.boundary_a};
}

/// Hands out the arrays of a level, each with a plane and a cell of zeros in front.
class Carver {
 public:
  Carver(HostLevel& level, int arrays)
      : guard_((level.row(0, 1) + 16) / 16 * 16),
        each_(guard_ + (level.cell_count() + 31) / 16 * 16) {
    level.storage = Buffer<float>(each_ * arrays);
    next_ = level.storage.data();
  }
  float* next() { return std::exchange(next_, next_ + each_) + guard_; }

 private:
  std::size_t guard_;
  std::size_t each_;
  float* next_ = nullptr;
};

const float* rounded(Carver& carver, const std::vector<double>& values, double factor = 1.0) {
  float* to = carver.next();
  std::transform(values.begin(), values.end(), to, [factor](double v) {
    return static_cast<float>(factor * v);
  });
  return to;
}

const float* inverse_of(Carver& carver, const std::vector<double>& values, double factor) {
  float* to = carver.next();
  std::transform(values.begin(), values.end(), to, [factor](double v) {
    return static_cast<float>(factor / v);
  });
  return to;
}

const float* own_weights(Carver& carver, const Level& level) {
  float* to = carver.next();
  std::fill_n(to, level.cell_count(), 1.0F);
  for (const std::vector<double>& weights : level.transfer)
    for (std::size_t c = 0; c < weights.size(); ++c) to[c] -= static_cast<float>(weights[c]);
  return to;
}

/// The x weights, without those of the surface: there is no aggregate to reach.
const float* x_weights(Carver& carver, const Level& level) {
  const float* weights = rounded(carver, level.transfer[0]);
  auto* at = const_cast<float*>(weights);
  const auto nx = static_cast<std::size_t>(level.cells[0]);
  for (std::size_t row = 0; level.ratio[0] == 2 && row < level.cell_count(); row += nx) {
    at[row] = 0.0F;
    if (nx % 2 == 0) at[row + nx - 1] = 0.0F;
  }
  return weights;
}

const float* sinks(Carver& carver, const Level& level, double unit) {
  std::vector<double> sink = level.diagonal;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double>& g = level.conductance[axis];
    const std::size_t stride = level.stride(axis);
    for (std::size_t c = 0; c < sink.size(); ++c)
      sink[c] -= g[c] + (c < stride ? 0.0 : g[c - stride]);
  }
  return rounded(carver, sink, 1.0 / unit);
}

HostLevel round_level(const Level& level, double unit) {
  HostLevel made;
  std::tie(made.nx, made.ni, made.no) = std::tuple_cat(level.cells);
  made.ratio = level.ratio;
  Carver carver(made, 9);
  made.gx = rounded(carver, level.conductance[0], 1.0 / unit);
  made.gi = rounded(carver, level.conductance[1], 1.0 / unit);
  made.go = rounded(carver, level.conductance[2], 1.0 / unit);
  made.sink = sinks(carver, level, unit);
  made.inverse = inverse_of(carver, level.diagonal, unit);
  made.own = own_weights(carver, level);
  made.wx = x_weights(carver, level);
  made.wi = rounded(carver, level.transfer[1]);
  made.wo = rounded(carver, level.transfer[2]);
  return made;
}

}  // namespace

HostGrid build_host_grid(const Medium& medium) {
  const Block& block = medium.block;
  const bool exchange = block.ny > block.nz;
  std::vector<Level> levels =
      diffusion::build_levels(exchange ? with_y_and_z_exchanged(medium) : medium);
  HostGrid grid;
  const auto nx = static_cast<std::size_t>(block.nx);
  grid.inner_stride = exchange ? nx * block.ny : nx;
  grid.outer_stride = exchange ? nx : nx * block.ny;
  const std::vector<double>& diagonal = levels.front().diagonal;
  grid.unit = *std::max_element(diagonal.begin(), diagonal.end());
  for (const Level& level : levels) grid.levels.push_back(round_level(level, grid.unit));
  grid.finest = std::move(levels.front());
  return grid;
}

}  // namespace opaline::reconstruct::host
