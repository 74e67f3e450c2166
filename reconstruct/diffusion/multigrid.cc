#include "reconstruct/diffusion/multigrid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kCoarsenBelow = 1.7;  // times the shortest cell edge
constexpr double kOvercorrection = 1.1;

/// What a level is made of besides its matrix: needed only to build the next one.
struct Parts {
  std::array<double, 3> spacing{};
  std::vector<double> sink;  ///< absorption, V sigma_a
  std::array<std::array<std::vector<double>, 2>, 3>
      wall;  ///< boundary conductance, [axis][min, max][face cell]
};

using Cell = std::array<int, 3>;

std::size_t index(const std::array<int, 3>& cells, const Cell& c) {
  return (static_cast<std::size_t>(c[2]) * cells[1] + c[1]) * cells[0] + c[0];
}

/// A cell's place in the raster of cells with the same axes but one.
std::size_t wall_index(const std::array<int, 3>& cells, const Cell& c, int axis) {
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  return static_cast<std::size_t>(c[v]) * cells[u] + c[u];
}

std::size_t wall_count(const std::array<int, 3>& cells, int axis) {
  return static_cast<std::size_t>(cells[0]) * cells[1] * cells[2] / cells[axis];
}

template <class F>
void for_each_cell(const std::array<int, 3>& cells, F f) {
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i) f(Cell{i, j, k});
}

void allocate(Level& level, Parts& parts) {
  for (int axis = 0; axis < 3; ++axis) {
    level.conductance[axis].assign(level.cell_count(), 0.0);
    for (auto& side : parts.wall[axis]) side.assign(wall_count(level.cells, axis), 0.0);
  }
  parts.sink.assign(level.cell_count(), 0.0);
}

/// f(cell, place on the wall) for the first (side 0) or last (side 1) cells along an axis.
template <class F>
void for_each_wall_cell(const std::array<int, 3>& cells, int axis, int side, F f) {
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  Cell c{};
  c[axis] = side == 0 ? 0 : cells[axis] - 1;
  std::size_t place = 0;
  for (c[v] = 0; c[v] < cells[v]; ++c[v])
    for (c[u] = 0; c[u] < cells[u]; ++c[u]) f(index(cells, c), c, place++);
}

void sum_diagonal(Level& level, const Parts& parts) {
  level.diagonal = parts.sink;
  double* d = level.diagonal.data();
  const std::size_t count = level.cell_count();
  for (int axis = 0; axis < 3; ++axis) {
    const double* g = level.conductance[axis].data();
    const std::size_t stride = level.stride(axis);
    for (std::size_t c = 0; c < count; ++c) d[c] += g[c];
    for (std::size_t c = stride; c < count; ++c)
      d[c] += g[c - stride];  // 0 behind the last of a line
    for (int side = 0; side < 2; ++side)
      for_each_wall_cell(
          level.cells, axis, side, [&](std::size_t at, const Cell&, std::size_t place) {
            d[at] += parts.wall[axis][side][place];
          });
  }
}

/// f(first cell, number of cells) for every run of cells, contiguous in memory, that have a next one along the axis.
template <class F>
void for_each_run(const Level& level, int axis, F f) {
  const std::size_t stride = level.stride(axis);
  const std::size_t line = stride * level.cells[axis];
  for (std::size_t start = 0; start < level.cell_count(); start += line) f(start, line - stride);
}

void add_finest_axis(const Medium& medium, int axis, Level& level, Parts& parts) {
  const double h = parts.spacing[axis];
  const double area = medium.block.cell_volume() / h;
  const double* kappa = medium.diffusion.data();
  double* g = level.conductance[axis].data();
  const std::size_t stride = level.stride(axis);
  for_each_run(level, axis, [&](std::size_t first, std::size_t count) {
    for (std::size_t c = first; c < first + count; ++c)
      g[c] = area / h * 2.0 * kappa[c] * kappa[c + stride] / (kappa[c] + kappa[c + stride]);
  });
  for (int side = 0; side < 2; ++side)
    for_each_wall_cell(
        level.cells, axis, side, [&](std::size_t at, const Cell&, std::size_t place) {
          parts.wall[axis][side][place] = area / (2.0 * medium.boundary_a + h / (2.0 * kappa[at]));
        });
}

Parts build_finest(const Medium& medium, Level& level) {
  Parts parts;
  level.cells = medium.block.cells();
  parts.spacing = medium.block.spacing();
  allocate(level, parts);
  for (std::size_t c = 0; c < parts.sink.size(); ++c)
    parts.sink[c] = medium.block.cell_volume() * medium.absorption[c];
  for (int axis = 0; axis < 3; ++axis) add_finest_axis(medium, axis, level, parts);
  sum_diagonal(level, parts);
  return parts;
}

std::array<int, 3> choose_ratio(const Level& level, const Parts& parts) {
  double shortest = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis)
    if (level.cells[axis] > 1) shortest = std::min(shortest, parts.spacing[axis]);
  std::array<int, 3> ratio{1, 1, 1};
  for (int axis = 0; axis < 3; ++axis)
    if (level.cells[axis] > 1 && parts.spacing[axis] < kCoarsenBelow * shortest) ratio[axis] = 2;
  return ratio;
}

/// Fine cells in step along one axis of ratio 2, each the last of its aggregate: first, first + step, ...
struct FaceRun {
  std::size_t first;
  std::size_t step;
  int count;
  bool paired;           ///< whether the aggregates beyond have two cells
  std::size_t coarse;    ///< the first one's aggregate
  int cells_per_coarse;  ///< steps that stay in one aggregate
};

/// Weights of both cells at each face of a run, and the face's share of the conductance between the aggregates.
void coarsen_run(
    const FaceRun& run, std::size_t stride, const double* g, double* weight, double* coarse) {
  const double distance = run.paired ? 2.0 : 1.5;  // between the centres, in fine cells
  for (int n = 0; n < run.count; ++n) {
    const std::size_t at = run.first + n * run.step;
    const double before = 0.5 / g[at - stride];
    const double after = run.paired ? 0.5 / g[at + stride] : 0.0;
    const double series = 1.0 / (before + 1.0 / g[at] + after);
    weight[at] = before * series;
    weight[at + stride] = after * series;
    coarse[run.coarse + n / run.cells_per_coarse] += g[at] / distance;
  }
}

/// Calls f(FaceRun) for all faces between aggregates along an axis.
template <class F>
void for_each_face_run(const Level& fine, const Level& coarse, int axis, F f) {
  const int n = fine.cells[axis];
  const int faces = (n - 1) / 2;
  const std::array<int, 3>& ratio = fine.ratio;
  for (int v = 0; v < fine.cells[axis == 2 ? 1 : 2]; ++v) {
    if (axis == 0) {
      for (int j = 0; j < fine.cells[1]; ++j) {
        const std::size_t row = index(fine.cells, {0, j, v});
        const std::size_t above = index(coarse.cells, {0, j / ratio[1], v / ratio[2]});
        const int full = std::max(0, n % 2 == 0 ? faces : faces - 1);
        f(FaceRun{row + 1, 2, full, true, above, 1});
        if (full < faces) f(FaceRun{row + n - 2, 2, 1, false, above + full, 1});
      }
      continue;
    }
    for (int face = 0; face < faces; ++face) {
      const Cell first = axis == 1 ? Cell{0, 2 * face + 1, v} : Cell{0, v, 2 * face + 1};
      const Cell above{0, first[1] / ratio[1], first[2] / ratio[2]};
      f(FaceRun{index(fine.cells, first),
                1,
                fine.cells[0],
                2 * face + 3 < n,
                index(coarse.cells, above),
                ratio[0]});
    }
  }
}

Cell parent_of(const Cell& c, const std::array<int, 3>& ratio) {
  return {c[0] / ratio[0], c[1] / ratio[1], c[2] / ratio[2]};
}

/// The surface's share: half the link inside the aggregate in series with the fine wall.
void coarsen_walls(Level& fine, const Parts& from, int axis, const Level& coarse, Parts& parts) {
  const bool paired = fine.ratio[axis] == 2;
  const std::size_t stride = fine.stride(axis);
  const std::vector<double>& g = fine.conductance[axis];
  for (int side = 0; side < 2; ++side)
    for_each_wall_cell(
        fine.cells, axis, side, [&](std::size_t at, const Cell& c, std::size_t place) {
          const bool alone = !paired || fine.cells[axis] == 1 || (side == 1 && c[axis] % 2 == 0);
          const double inner = alone ? 0.0 : 0.5 / g[side == 0 ? at : at - stride];
          const double series = 1.0 / (inner + 1.0 / from.wall[axis][side][place]);
          if (paired && !alone) fine.transfer[axis][at] = inner * series;
          parts.wall[axis][side][wall_index(coarse.cells, parent_of(c, fine.ratio), axis)] +=
              series;
        });
}

void add_to_parents(const Level& fine,
                    const Level& coarse,
                    const std::vector<double>& values,
                    double* sums) {
  const double* value = values.data();
  for (int k = 0; k < fine.cells[2]; ++k)
    for (int j = 0; j < fine.cells[1]; ++j) {
      double* row = sums + index(coarse.cells, {0, j / fine.ratio[1], k / fine.ratio[2]});
      for (int i = 0; i < fine.cells[0]; ++i) row[i / fine.ratio[0]] += *value++;
    }
}

/// Fills the fine level's transfer weights and the coarse conductances and walls of one axis.
void coarsen_axis(Level& fine, const Parts& from, int axis, Level& coarse, Parts& parts) {
  const double* g = fine.conductance[axis].data();
  double* below = coarse.conductance[axis].data();
  fine.transfer[axis].clear();
  if (fine.ratio[axis] == 2) {
    fine.transfer[axis].assign(fine.cell_count(), 0.0);
    for_each_face_run(fine, coarse, axis, [&](const FaceRun& run) {
      coarsen_run(run, fine.stride(axis), g, fine.transfer[axis].data(), below);
    });
  } else {
    add_to_parents(fine, coarse, fine.conductance[axis], below);
  }
  coarsen_walls(fine, from, axis, coarse, parts);
}

/// Where jumps of kappa make the weights of a cell add up to more than one they share one.
void bound_weights(Level& level) {
  std::vector<double> sum(level.cell_count(), 0.0);
  for (const auto& weights : level.transfer)
    for (std::size_t c = 0; c < weights.size(); ++c) sum[c] += weights[c];
  if (*std::max_element(sum.begin(), sum.end()) <= 1.0) return;
  for (auto& weights : level.transfer)
    for (std::size_t c = 0; c < weights.size(); ++c) weights[c] /= std::max(1.0, sum[c]);
}

void divide(std::vector<double>& values, double by) {
  for (double& value : values) value /= by;
}

void soften(Level& level, Parts& parts) {
  for (auto& g : level.conductance) divide(g, kOvercorrection);
  divide(parts.sink, kOvercorrection);
  for (auto& walls : parts.wall)
    for (auto& side : walls) divide(side, kOvercorrection);
}

Parts coarsen(Level& fine, const Parts& from, Level& coarse) {
  Parts parts;
  for (int axis = 0; axis < 3; ++axis) {
    coarse.cells[axis] = (fine.cells[axis] + fine.ratio[axis] - 1) / fine.ratio[axis];
    parts.spacing[axis] = from.spacing[axis] * fine.ratio[axis];
  }
  allocate(coarse, parts);
  add_to_parents(fine, coarse, from.sink, parts.sink.data());
  for (int axis = 0; axis < 3; ++axis) coarsen_axis(fine, from, axis, coarse, parts);
  bound_weights(fine);
  soften(coarse, parts);
  sum_diagonal(coarse, parts);
  return parts;
}

}  // namespace

std::vector<Level> build_levels(const Medium& medium) {
  std::vector<Level> levels;
  rebuild_levels(medium, levels);
  return levels;
}

void rebuild_levels(const Medium& medium, std::vector<Level>& levels) {
  if (levels.empty()) levels.emplace_back();
  std::size_t l = 0;
  for (Parts parts = build_finest(medium, levels[0]); levels[l].cell_count() > 1; ++l) {
    levels[l].ratio = choose_ratio(levels[l], parts);
    if (l + 1 == levels.size()) levels.emplace_back();
    parts = coarsen(levels[l], parts, levels[l + 1]);
  }
  levels.resize(l + 1);
  levels[l].ratio = {1, 1, 1};
  for (auto& weights : levels[l].transfer) weights.clear();
}

void residual(const Level& level, const double* b, const double* x, double* r) {
  for_each_cell(level.cells, [&](const Cell& c) {
    const std::size_t at = index(level.cells, c);
    double sum = b[at] - level.diagonal[at] * x[at];
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t stride = level.stride(axis);
      if (c[axis] > 0) sum += level.conductance[axis][at - stride] * x[at - stride];
      if (c[axis] + 1 < level.cells[axis]) sum += level.conductance[axis][at] * x[at + stride];
    }
    r[at] = sum;
  });
}

}  // namespace opaline::reconstruct::diffusion
