#include "reconstruct/host/host_grid.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace opaline::reconstruct::host {
namespace {

using diffusion::Level;
using diffusion::Medium;

/// The same medium with the axes x, z, y.
void exchange_y_and_z(const Medium& medium, ThreadTeam& team, Medium& exchanged) {
  const Block& b = medium.block;
  exchanged.block = {b.nx, b.nz, b.ny, b.hx, b.hz, b.hy};
  exchanged.boundary_a = medium.boundary_a;
  exchanged.diffusion.resize(b.cell_count());
  exchanged.absorption.resize(b.cell_count());
  team.run([&](int thread) {
    for (int j = b.ny * thread / team.size(); j < b.ny * (thread + 1) / team.size(); ++j)
      for (int k = 0; k < b.nz; ++k) {
        const std::size_t from = b.index(0, j, k);
        const std::size_t to = exchanged.block.index(0, k, j);
        std::copy_n(medium.diffusion.data() + from, b.nx, exchanged.diffusion.data() + to);
        std::copy_n(medium.absorption.data() + from, b.nx, exchanged.absorption.data() + to);
      }
  });
}

/// Where a level's arrays lie, each with a plane and a cell of zeros in front.
template <class T>
class Carver {
 public:
  Carver(HostLevel<T>& level, std::size_t arrays)
      : level_(level),
        guard_((level.row(0, 1) + 16) / 16 * 16),
        each_(guard_ + (level.cell_count() + 31) / 16 * 16) {
    if (level.storage.size() != each_ * arrays) level.storage = Buffer<T>(each_ * arrays);
  }
  T* array(std::size_t n) { return level_.storage.data() + n * each_ + guard_; }

 private:
  HostLevel<T>& level_;
  std::size_t guard_;
  std::size_t each_;
};

/// factor times the values of cells begin ... end; zeros where there are none.
template <class T>
void round_values(
    const std::vector<double>& values, double factor, std::size_t begin, std::size_t end, T* to) {
  if (values.empty())
    std::fill(to + begin, to + end, T{0});
  else
    for (std::size_t c = begin; c < end; ++c) to[c] = static_cast<T>(factor * values[c]);
}

template <class T>
void round_own(const Level& level, std::size_t begin, std::size_t end, T* own) {
  std::fill(own + begin, own + end, T{1});
  for (const std::vector<double>& weights : level.transfer)
    for (std::size_t c = begin; c < std::min(end, weights.size()); ++c)
      own[c] -= static_cast<T>(weights[c]);
}

/// Without the x weights of the surface: there is no aggregate to reach. begin starts a row.
template <class T>
void drop_surface_weights(const Level& level, std::size_t begin, std::size_t end, T* wx) {
  const auto nx = static_cast<std::size_t>(level.cells[0]);
  for (std::size_t row = begin; level.ratio[0] == 2 && row < end; row += nx) {
    wx[row] = T{0};
    if (nx % 2 == 0) wx[row + nx - 1] = T{0};
  }
}

template <class T>
void round_diagonal(
    const Level& level, double unit, std::size_t begin, std::size_t end, T* sink, T* inverse) {
  for (std::size_t c = begin; c < end; ++c) {
    double sum = level.diagonal[c];
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t stride = level.stride(axis);
      sum -= level.conductance[axis][c] + (c < stride ? 0.0 : level.conductance[axis][c - stride]);
    }
    sink[c] = static_cast<T>(sum / unit);
    inverse[c] = static_cast<T>(unit / level.diagonal[c]);
  }
}

template <class T>
void round_level(const Level& level, double unit, ThreadTeam& team, HostLevel<T>& made) {
  std::tie(made.nx, made.ni, made.no) = std::tuple_cat(level.cells);
  made.ratio = level.ratio;
  Carver<T> carver(made, 9);
  const std::array<const std::vector<double>*, 6> values{&level.conductance[0],
                                                         &level.conductance[1],
                                                         &level.conductance[2],
                                                         &level.transfer[0],
                                                         &level.transfer[1],
                                                         &level.transfer[2]};
  const auto rows = static_cast<std::size_t>(made.ni) * made.no;
  const std::size_t parts = made.cell_count() > 4096 ? team.size() : 1;
  const auto round = [&](std::size_t part) {
    const std::size_t begin = rows * part / parts * made.nx;
    const std::size_t end = rows * (part + 1) / parts * made.nx;
    for (std::size_t n = 0; n < values.size(); ++n)
      round_values(*values[n], n < 3 ? 1.0 / unit : 1.0, begin, end, carver.array(n));
    drop_surface_weights(level, begin, end, carver.array(3));
    round_own(level, begin, end, carver.array(6));
    round_diagonal(level, unit, begin, end, carver.array(7), carver.array(8));
  };
  if (parts == 1)
    round(0);
  else
    team.run([&](int thread) { round(static_cast<std::size_t>(thread)); });
  const std::array<const T**, 9> arrays{&made.gx,
                                        &made.gi,
                                        &made.go,
                                        &made.wx,
                                        &made.wi,
                                        &made.wo,
                                        &made.own,
                                        &made.sink,
                                        &made.inverse};
  for (std::size_t n = 0; n < arrays.size(); ++n) *arrays[n] = carver.array(n);
}

}  // namespace

template <class T>
void build_host_grid(const Medium& medium, ThreadTeam& team, HostGrid<T>& grid) {
  const Block& block = medium.block;
  std::tie(grid.nx, grid.ny, grid.nz) = std::tuple_cat(block.cells());
  grid.exchanged = block.ny > block.nz;
  if (grid.exchanged) exchange_y_and_z(medium, team, grid.medium);
  grid.builder.build(grid.exchanged ? grid.medium : medium, team, grid.exact);
  const std::vector<double>& diagonal = grid.exact.front().diagonal;
  grid.unit = *std::max_element(diagonal.begin(), diagonal.end());
  grid.levels.resize(grid.exact.size());
  for (std::size_t l = 0; l < grid.levels.size(); ++l)
    round_level(grid.exact[l], grid.unit, team, grid.levels[l]);
}

template void build_host_grid(const Medium&, ThreadTeam&, HostGrid<float>&);
template void build_host_grid(const Medium&, ThreadTeam&, HostGrid<double>&);

}  // namespace opaline::reconstruct::host
