#include "reconstruct/diffusion/multigrid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kCoarsenBelow = 1.7;  // times the shortest cell edge

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

void sum_diagonal(Level& level, const Parts& parts) {
  level.diagonal = parts.sink;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = level.stride(axis);
    for_each_cell(level.cells, [&](const Cell& c) {
      const std::size_t at = index(level.cells, c);
      double& sum = level.diagonal[at];
      sum += level.conductance[axis][at];
      if (c[axis] > 0) sum += level.conductance[axis][at - stride];
      if (c[axis] == 0) sum += parts.wall[axis][0][wall_index(level.cells, c, axis)];
      if (c[axis] == level.cells[axis] - 1)
        sum += parts.wall[axis][1][wall_index(level.cells, c, axis)];
    });
  }
}

void add_finest_axis(const Medium& medium, int axis, Level& level, Parts& parts) {
  const double h = parts.spacing[axis];
  const double area = medium.block.cell_volume() / h;
  const std::size_t stride = level.stride(axis);
  const auto wall = [&](double kappa) {
    return area / (2.0 * medium.boundary_a + h / (2.0 * kappa));
  };
  for_each_cell(level.cells, [&](const Cell& c) {
    const std::size_t at = index(level.cells, c);
    const double kappa = medium.diffusion[at];
    const std::size_t on_wall = wall_index(level.cells, c, axis);
    if (c[axis] == 0) parts.wall[axis][0][on_wall] = wall(kappa);
    if (c[axis] == level.cells[axis] - 1) {
      parts.wall[axis][1][on_wall] = wall(kappa);
    } else {
      const double next = medium.diffusion[at + stride];
      level.conductance[axis][at] = area / h * 2.0 * kappa * next / (kappa + next);
    }
  });
}

std::pair<Level, Parts> finest(const Medium& medium) {
  std::pair<Level, Parts> made;
  auto& [level, parts] = made;
  level.cells = medium.block.cells();
  parts.spacing = medium.block.spacing();
  allocate(level, parts);
  for (std::size_t c = 0; c < parts.sink.size(); ++c)
    parts.sink[c] = medium.block.cell_volume() * medium.absorption[c];
  for (int axis = 0; axis < 3; ++axis) add_finest_axis(medium, axis, level, parts);
  sum_diagonal(level, parts);
  return made;
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

/// Resistances along one grid line through cell c, as seen from its aggregate's centre, for an axis
/// of ratio 2.
class Line {
 public:
  Line(const Level& level, const Parts& parts, int axis)
      : level_(level), parts_(parts), axis_(axis), stride_(level.stride(axis)) {}

  /// From the centre of c's aggregate to c: half the link between the two cells, nothing when c is
  /// alone.
  double inner(const Cell& c) const {
    const int first = c[axis_] / 2 * 2;
    if (first + 1 >= level_.cells[axis_]) return 0.0;
    const std::size_t at = index(level_.cells, c) - (c[axis_] - first) * stride_;
    return 0.5 / level_.conductance[axis_][at];
  }
  /// From c through its face to aggregate or surface outside, on the given side, to the centre
  /// there.
  double outer(const Cell& c, bool forward) const {
    const int last = level_.cells[axis_] - 1;
    if (c[axis_] == (forward ? last : 0))
      return 1.0 / parts_.wall[axis_][forward ? 1 : 0][wall_index(level_.cells, c, axis_)];
    Cell next = c;
    next[axis_] += forward ? 1 : -1;
    const std::size_t face = index(level_.cells, forward ? c : next);
    return 1.0 / level_.conductance[axis_][face] + inner(next);
  }

 private:
  const Level& level_;
  const Parts& parts_;
  int axis_;
  std::size_t stride_;
};

/// The weights w of Level::transfer; where jumps of kappa make them add up to more than one they
/// share one.
void weigh_transfer(Level& level, const Parts& parts) {
  std::vector<double> sum(level.cell_count(), 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    if (level.ratio[axis] == 1) continue;
    level.transfer[axis].assign(level.cell_count(), 0.0);
    const Line line(level, parts, axis);
    for_each_cell(level.cells, [&](const Cell& c) {
      const std::size_t at = index(level.cells, c);
      const double inner = line.inner(c);
      level.transfer[axis][at] = inner / (inner + line.outer(c, c[axis] % 2 == 1));
      sum[at] += level.transfer[axis][at];
    });
  }
  for (auto& weights : level.transfer)
    for (std::size_t c = 0; c < weights.size(); ++c) weights[c] /= std::max(1.0, sum[c]);
}

Cell parent_of(const Cell& c, const std::array<int, 3>& ratio) {
  return {c[0] / ratio[0], c[1] / ratio[1], c[2] / ratio[2]};
}

/// Adds the fine lines' share to the coarse conductances and walls of one axis.
void coarsen_axis(const Level& fine, const Parts& from, int axis, Level& coarse, Parts& parts) {
  const Line line(fine, from, axis);
  const bool paired = fine.ratio[axis] == 2;
  const auto series = [&](const Cell& c, bool forward) {
    if (paired) return 1.0 / (line.inner(c) + line.outer(c, forward));
    const int last = fine.cells[axis] - 1;
    if (c[axis] == (forward ? last : 0))
      return from.wall[axis][forward ? 1 : 0][wall_index(fine.cells, c, axis)];
    return fine.conductance[axis][index(fine.cells, c)];
  };
  for_each_cell(fine.cells, [&](const Cell& c) {
    const Cell above = parent_of(c, fine.ratio);
    if (c[axis] == 0)
      parts.wall[axis][0][wall_index(coarse.cells, above, axis)] += series(c, false);
    if (c[axis] == fine.cells[axis] - 1)
      parts.wall[axis][1][wall_index(coarse.cells, above, axis)] += series(c, true);
    else if (!paired || c[axis] % 2 == 1)
      coarse.conductance[axis][index(coarse.cells, above)] += series(c, true);
  });
}

std::pair<Level, Parts> coarsen(const Level& fine, const Parts& from) {
  std::pair<Level, Parts> made;
  auto& [coarse, parts] = made;
  for (int axis = 0; axis < 3; ++axis) {
    coarse.cells[axis] = (fine.cells[axis] + fine.ratio[axis] - 1) / fine.ratio[axis];
    parts.spacing[axis] = from.spacing[axis] * fine.ratio[axis];
  }
  allocate(coarse, parts);
  for_each_cell(fine.cells, [&](const Cell& c) {
    parts.sink[index(coarse.cells, parent_of(c, fine.ratio))] += from.sink[index(fine.cells, c)];
  });
  for (int axis = 0; axis < 3; ++axis) coarsen_axis(fine, from, axis, coarse, parts);
  sum_diagonal(coarse, parts);
  return made;
}

}  // namespace

std::vector<Level> build_levels(const Medium& medium) {
  std::vector<Level> levels;
  auto [level, parts] = finest(medium);
  while (level.cell_count() > 1) {
    level.ratio = choose_ratio(level, parts);
    weigh_transfer(level, parts);
    auto next = coarsen(level, parts);
    levels.push_back(std::move(level));
    level = std::move(next.first);
    parts = std::move(next.second);
  }
  levels.push_back(std::move(level));
  return levels;
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
