#include "reconstruct/diffusion/level_builder.h"

#include <algorithm>
#include <cmath>

namespace opaline::reconstruct::diffusion {
namespace {

using Parts = LevelBuilder::Parts;
using Cells = std::array<int, 3>;

constexpr double kCoarsenBelow = 1.7;  // times the shortest cell edge
constexpr double kOvercorrection = 1.1;
constexpr std::size_t kWorthSharing = 4096;  // cells

/// Planes of a level that a thread answers for.
struct Slab {
  int begin;
  int end;
  bool has(int plane) const { return begin <= plane && plane < end; }
};

/// f(slab) for all planes of a level, shared by the team where that is worth it.
template <class F>
void for_slabs(ThreadTeam& team, const Level& level, const F& f) {
  const int planes = level.cells[2];
  const int parts = level.cell_count() > kWorthSharing ? std::min(team.size(), planes) : 1;
  if (parts == 1) {
    f(Slab{0, planes});
    return;
  }
  team.run([&](int thread) {
    if (thread < parts) f(Slab{planes * thread / parts, planes * (thread + 1) / parts});
  });
}

/// The fine planes below a slab of coarse ones.
Slab below(const Slab& coarse, const Level& fine) {
  return {coarse.begin * fine.ratio[2], std::min(coarse.end * fine.ratio[2], fine.cells[2])};
}

std::size_t plane_at(const Level& level, int k) { return level.stride(2) * k; }

std::size_t row_at(const Level& level, int j, int k) {
  return plane_at(level, k) + level.stride(1) * j;
}

/// f(first cell, number of cells, number behind them) for every run of cells of the slab, contiguous in memory, that have a next
/// one along the axis, and the last ones of their lines behind them.
template <class F>
void for_each_run(const Level& level, int axis, Slab slab, F f) {
  const std::size_t stride = level.stride(axis);
  if (axis == 2) {
    const int last = std::min(slab.end, level.cells[2] - 1);
    f(plane_at(level, slab.begin), stride * (last - slab.begin), stride * (slab.end - last));
    return;
  }
  const std::size_t line = stride * level.cells[axis];
  const std::size_t end = plane_at(level, slab.end);
  for (std::size_t start = plane_at(level, slab.begin); start < end; start += line)
    f(start, line - stride, stride);
}

/// f(cell, indices, place on the wall) for the slab's first (side 0) or last (side 1) cells along an axis.
template <class F>
void for_each_wall_cell(const Level& level, int axis, int side, Slab slab, F f) {
  const Cells& cells = level.cells;
  const int at = side == 0 ? 0 : cells[axis] - 1;
  if (axis == 2) {
    if (!slab.has(at)) return;
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        f(row_at(level, j, at) + i, Cells{i, j, at}, row_at(level, j, 0) + i);
    return;
  }
  const int across = axis == 0 ? 1 : 0;
  for (int k = slab.begin; k < slab.end; ++k)
    for (int n = 0; n < cells[across]; ++n) {
      const Cells c = axis == 0 ? Cells{at, n, k} : Cells{n, at, k};
      f(row_at(level, c[1], k) + c[0], c, static_cast<std::size_t>(k) * cells[across] + n);
    }
}

/// A cell's place in the raster of cells with the same axes but one.
std::size_t wall_index(const Cells& cells, const Cells& c, int axis) {
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  return static_cast<std::size_t>(c[v]) * cells[u] + c[u];
}

void size_for(Level& level, Parts& parts) {
  const std::size_t count = level.cell_count();
  for (int axis = 0; axis < 3; ++axis) {
    level.conductance[axis].resize(count);
    for (auto& side : parts.wall[axis]) side.resize(count / level.cells[axis]);
  }
  parts.sink.resize(count);
  level.diagonal.resize(count);
}

void fill_finest_axis(const Medium& medium, int axis, Slab slab, Level& level, Parts& parts) {
  const double h = parts.spacing[axis];
  const double area = medium.block.cell_volume() / h;
  const double twice = 2.0 * area / h;
  const double* kappa = medium.diffusion.data();
  double* g = level.conductance[axis].data();
  const std::size_t stride = level.stride(axis);
  for_each_run(level, axis, slab, [&](std::size_t first, std::size_t count, std::size_t ends) {
    for (std::size_t c = first; c < first + count; ++c)
      g[c] = twice * kappa[c] * kappa[c + stride] / (kappa[c] + kappa[c + stride]);
    std::fill_n(g + first + count, ends, 0.0);
  });
  for (int side = 0; side < 2; ++side)
    for_each_wall_cell(
        level, axis, side, slab, [&](std::size_t at, const Cells&, std::size_t place) {
          parts.wall[axis][side][place] = area / (2.0 * medium.boundary_a + h / (2.0 * kappa[at]));
        });
}

void fill_finest(const Medium& medium, Slab slab, Level& level, Parts& parts) {
  const double volume = medium.block.cell_volume();
  for (std::size_t c = plane_at(level, slab.begin); c < plane_at(level, slab.end); ++c)
    parts.sink[c] = volume * medium.absorption[c];
  for (int axis = 0; axis < 3; ++axis) fill_finest_axis(medium, axis, slab, level, parts);
}

/// D of the slab: needs the conductances of the plane before it.
void sum_diagonal(Slab slab, const Parts& parts, Level& level) {
  double* d = level.diagonal.data();
  const double* sink = parts.sink.data();
  const double* gx = level.conductance[0].data();
  const double* gy = level.conductance[1].data();
  const double* gz = level.conductance[2].data();
  const std::size_t nx = level.stride(1);
  const std::size_t plane = level.stride(2);
  const std::size_t end = plane_at(level, slab.end);
  std::size_t c = plane_at(level, slab.begin);
  for (; c < std::min(plane, end); ++c)
    d[c] =
        sink[c] + gx[c] + (c < 1 ? 0.0 : gx[c - 1]) + gy[c] + (c < nx ? 0.0 : gy[c - nx]) + gz[c];
  for (; c < end; ++c)  // a neighbour beyond the end of a line: its conductance is 0
    d[c] = sink[c] + gx[c] + gx[c - 1] + gy[c] + gy[c - nx] + gz[c] + gz[c - plane];
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for_each_wall_cell(
          level, axis, side, slab, [&](std::size_t at, const Cells&, std::size_t place) {
            d[at] += parts.wall[axis][side][place];
          });
}

Cells choose_ratio(const Level& level, const Parts& parts) {
  double shortest = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis)
    if (level.cells[axis] > 1) shortest = std::min(shortest, parts.spacing[axis]);
  Cells ratio{1, 1, 1};
  for (int axis = 0; axis < 3; ++axis)
    if (level.cells[axis] > 1 && parts.spacing[axis] < kCoarsenBelow * shortest) ratio[axis] = 2;
  return ratio;
}

/// sums[n / ratio] += factor * values[n] for a row of cells.
void add_row(const double* values, int count, int ratio, double factor, double* sums) {
  if (ratio == 1) {
    for (int n = 0; n < count; ++n) sums[n] += factor * values[n];
    return;
  }
  for (std::ptrdiff_t n = 0; n < count / 2; ++n)
    sums[n] += factor * (values[2 * n] + values[2 * n + 1]);
  if (count % 2 == 1) sums[count / 2] += factor * values[count - 1];
}

void add_to_parents(const Level& fine,
                    const double* values,
                    double factor,
                    Slab slab,
                    const Level& coarse,
                    double* sums) {
  const std::array<int, 3>& ratio = fine.ratio;
  for (int k = slab.begin; k < slab.end; ++k)
    for (int j = 0; j < fine.cells[1]; ++j)
      add_row(values + row_at(fine, j, k),
              fine.cells[0],
              ratio[0],
              factor,
              sums + row_at(coarse, j / ratio[1], k / ratio[2]));
}

/// The weights of the two cells at a face between aggregates, from the conductances of the face (g), of the link
/// behind the first cell (inner) and of the one behind the second (outer; none where that is alone in its aggregate):
/// w = (1/2 1/inner) / (1/2 1/inner + 1/g + 1/2 1/outer), with one division.
struct FaceWeights {
  double first;
  double second;
};

FaceWeights paired_weights(double inner, double g, double outer) {
  const double half = 0.5 * g;
  const double scale = half / (half * (inner + outer) + inner * outer);
  return {scale * outer, scale * inner};
}

FaceWeights single_weights(double inner, double g) { return {0.5 * g / (0.5 * g + inner), 0.0}; }

/// The weights on both sides of the faces between aggregates along a row, and the faces' shares of the coarse conductances.
void coarsen_along_row(const double* g, int n, double* weight, double* coarse) {
  const int faces = (n - 1) / 2;
  const int full = n % 2 == 0 ? faces : std::max(0, faces - 1);
  for (int f = 0; f < full; ++f) {
    const int at = 2 * f + 1;
    const FaceWeights w = paired_weights(g[at - 1], g[at], g[at + 1]);
    weight[at] = w.first;
    weight[at + 1] = w.second;
    coarse[f] += g[at] * (1.0 / (2.0 * kOvercorrection));
  }
  if (full == faces) return;
  const FaceWeights w = single_weights(g[n - 3], g[n - 2]);
  weight[n - 2] = w.first;
  weight[n - 1] = w.second;
  coarse[full] += g[n - 2] * (1.0 / (1.5 * kOvercorrection));
}

/// The same for a row of faces that lie across it, the cells behind them a stride away.
void coarsen_across_row(
    const double* g, std::size_t stride, int count, bool paired, double* weight) {
  const double* inner = g - stride;
  const double* outer = g + stride;
  double* next = weight + stride;
  if (!paired) {
    for (int n = 0; n < count; ++n) weight[n] = single_weights(inner[n], g[n]).first;
    std::fill_n(next, count, 0.0);
    return;
  }
  for (int n = 0; n < count; ++n) {
    const FaceWeights w = paired_weights(inner[n], g[n], outer[n]);
    weight[n] = w.first;
    next[n] = w.second;
  }
}

/// All faces between aggregates along the axis whose first cell lies in the slab.
void coarsen_faces(Level& fine, int axis, Slab slab, Level& coarse) {
  const double* g = fine.conductance[axis].data();
  double* weight = fine.transfer[axis].data();
  double* sums = coarse.conductance[axis].data();
  const std::array<int, 3>& ratio = fine.ratio;
  const int n = fine.cells[axis];
  for (int k = slab.begin; k < slab.end; ++k)
    for (int j = 0; j < fine.cells[1]; ++j) {
      const std::size_t row = row_at(fine, j, k);
      double* above = sums + row_at(coarse, j / ratio[1], k / ratio[2]);
      if (axis == 0) {
        coarsen_along_row(g + row, n, weight + row, above);
        continue;
      }
      const int at = axis == 1 ? j : k;
      if (at % 2 == 0 || at + 1 == n) continue;
      const bool paired = at + 2 < n;
      coarsen_across_row(g + row, fine.stride(axis), fine.cells[0], paired, weight + row);
      add_row(
          g + row, fine.cells[0], ratio[0], 1.0 / ((paired ? 2.0 : 1.5) * kOvercorrection), above);
    }
}

Cells parent_of(const Cells& c, const Cells& ratio) {
  return {c[0] / ratio[0], c[1] / ratio[1], c[2] / ratio[2]};
}

/// The surface's share: half the link inside the aggregate in series with the fine wall.
void coarsen_walls(
    Level& fine, const Parts& from, int axis, Slab slab, const Level& coarse, Parts& parts) {
  const bool paired = fine.ratio[axis] == 2;
  const std::size_t stride = fine.stride(axis);
  const std::vector<double>& g = fine.conductance[axis];
  for (int side = 0; side < 2; ++side) {
    const bool alone = !paired || (side == 1 && fine.cells[axis] % 2 == 1);
    for_each_wall_cell(
        fine, axis, side, slab, [&](std::size_t at, const Cells& c, std::size_t place) {
          const double inner = alone ? 0.0 : 0.5 / g[side == 0 ? at : at - stride];
          const double series = 1.0 / (inner + 1.0 / from.wall[axis][side][place]);
          if (!alone) fine.transfer[axis][at] = inner * series;
          parts.wall[axis][side][wall_index(coarse.cells, parent_of(c, fine.ratio), axis)] +=
              series / kOvercorrection;
        });
  }
}

void clear(const Level& coarse, Slab slab, std::vector<double>& values) {
  std::fill(values.begin() + static_cast<std::ptrdiff_t>(plane_at(coarse, slab.begin)),
            values.begin() + static_cast<std::ptrdiff_t>(plane_at(coarse, slab.end)),
            0.0);
}

/// Fills the coarse level's conductances, walls and absorption in the slab, and the transfer weights of the fine cells below it.
void coarsen_slab(Level& fine, const Parts& from, Slab slab, Level& coarse, Parts& parts) {
  const Slab cells = below(slab, fine);
  clear(coarse, slab, parts.sink);
  add_to_parents(fine, from.sink.data(), 1.0, cells, coarse, parts.sink.data());
  for (int axis = 0; axis < 3; ++axis) {
    clear(coarse, slab, coarse.conductance[axis]);
    for (int side = 0; side < 2; ++side)
      for_each_wall_cell(
          coarse, axis, side, slab, [&](std::size_t, const Cells&, std::size_t place) {
            parts.wall[axis][side][place] = 0.0;
          });
    if (fine.ratio[axis] == 2)
      coarsen_faces(fine, axis, cells, coarse);
    else
      add_to_parents(fine,
                     fine.conductance[axis].data(),
                     1.0 / kOvercorrection,
                     cells,
                     coarse,
                     coarse.conductance[axis].data());
    coarsen_walls(fine, from, axis, cells, coarse, parts);
  }
}

/// Where jumps of kappa make the weights of a cell add up to more than one they share one.
void bound_weights(Slab slab, Level& level) {
  std::array<double*, 3> weights{};
  int axes = 0;
  for (auto& along : level.transfer)
    if (!along.empty()) weights[axes++] = along.data();
  for (std::size_t c = plane_at(level, slab.begin); c < plane_at(level, slab.end); ++c) {
    double sum = 0.0;
    for (int a = 0; a < axes; ++a) sum += weights[a][c];
    if (sum > 1.0)
      for (int a = 0; a < axes; ++a) weights[a][c] /= sum;
  }
}

void coarsen(Level& fine, const Parts& from, ThreadTeam& team, Level& coarse, Parts& parts) {
  for (int axis = 0; axis < 3; ++axis) {
    coarse.cells[axis] = (fine.cells[axis] + fine.ratio[axis] - 1) / fine.ratio[axis];
    parts.spacing[axis] = from.spacing[axis] * fine.ratio[axis];
    fine.transfer[axis].resize(fine.ratio[axis] == 2 ? fine.cell_count() : 0);
  }
  size_for(coarse, parts);
  for_slabs(team, coarse, [&](Slab slab) { coarsen_slab(fine, from, slab, coarse, parts); });
  for_slabs(team, coarse, [&](Slab slab) {
    bound_weights(below(slab, fine), fine);
    sum_diagonal(slab, parts, coarse);
  });
}

}  // namespace

void LevelBuilder::build(const Medium& medium, ThreadTeam& team, std::vector<Level>& levels) {
  const auto have = [&](std::size_t count) {
    if (levels.size() < count) levels.resize(count);
    if (parts_.size() < count) parts_.resize(count);
  };
  have(1);
  Level& finest = levels.front();
  finest.cells = medium.block.cells();
  parts_[0].spacing = medium.block.spacing();
  size_for(finest, parts_[0]);
  for_slabs(team, finest, [&](Slab slab) { fill_finest(medium, slab, finest, parts_[0]); });
  for_slabs(team, finest, [&](Slab slab) { sum_diagonal(slab, parts_[0], finest); });
  std::size_t l = 0;
  for (; levels[l].cell_count() > 1; ++l) {
    have(l + 2);
    levels[l].ratio = choose_ratio(levels[l], parts_[l]);
    coarsen(levels[l], parts_[l], team, levels[l + 1], parts_[l + 1]);
  }
  levels.resize(l + 1);
  levels[l].ratio = {1, 1, 1};
  for (auto& weights : levels[l].transfer) weights.clear();
}

}  // namespace opaline::reconstruct::diffusion
