#include "reconstruct/coarse_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr int kFewestCells = 4;

/// What a cell along one axis has of another grid's cells, and their weights, which add up to one.
struct Term {
  int cell = 0;
  double weight = 0.0;
};
using AxisTerms = std::vector<std::vector<Term>>;  // per cell of the grid that values are wanted on

// The mean over each of `to` equal cells of values on `from` equal cells of the same length.
AxisTerms means(int from, int to) {
  AxisTerms terms(static_cast<std::size_t>(to));
  for (int t = 0; t < to; ++t) {
    const double low = static_cast<double>(t) * from / to;
    const double high = static_cast<double>(t + 1) * from / to;
    for (int f = static_cast<int>(low); f < from && f < high - 1e-9; ++f) {
      const double overlap = std::min(high, f + 1.0) - std::max(low, static_cast<double>(f));
      if (overlap > 1e-9) terms[static_cast<std::size_t>(t)].push_back({f, overlap * to / from});
    }
  }
  return terms;
}

AxisTerms interpolations(int from, int to) {
  AxisTerms terms(static_cast<std::size_t>(to));
  for (int t = 0; t < to; ++t) {
    const double at = std::clamp((t + 0.5) * from / to - 0.5, 0.0, from - 1.0);
    const int left = std::min(static_cast<int>(at), std::max(from - 2, 0));
    const double right = at - left;
    terms[static_cast<std::size_t>(t)].push_back({left, 1.0 - right});
    if (right > 0.0) terms[static_cast<std::size_t>(t)].push_back({left + 1, right});
  }
  return terms;
}

std::vector<double> transferred(const std::array<AxisTerms, 3>& axes,
                                const Block& from,
                                std::span<const double> values) {
  ENSURE(values.size() == from.cell_count());
  std::vector<double> out;
  out.reserve(axes[0].size() * axes[1].size() * axes[2].size());
  for (const auto& zs : axes[2])
    for (const auto& ys : axes[1])
      for (const auto& xs : axes[0]) {
        double sum = 0.0;
        for (const Term& z : zs)
          for (const Term& y : ys)
            for (const Term& x : xs)
              sum += z.weight * y.weight * x.weight * values[from.index(x.cell, y.cell, z.cell)];
        out.push_back(sum);
      }
  return out;
}

/// From one raster of a face to a coarser one.
class FaceMeans {
 public:
  FaceMeans(const Block& from, const Block& to, Face face)
      : width_(from.face_width(face)),
        columns_(means(width_, to.face_width(face))),
        rows_(means(from.face_height(face), to.face_height(face))),
        cells_(static_cast<double>(from.face_cell_count(face)) /
               static_cast<double>(to.face_cell_count(face))) {}

  /// Calls visit(coarse cell, fine cell, its share of the coarse cell's area).
  template <class Visit>
  void for_each(Visit visit) const {
    std::size_t coarse = 0;
    for (const auto& row : rows_)
      for (const auto& column : columns_) {
        for (const Term& y : row)
          for (const Term& x : column)
            visit(coarse, static_cast<std::size_t>(y.cell) * width_ + x.cell, x.weight * y.weight);
        ++coarse;
      }
  }
  std::size_t size() const { return rows_.size() * columns_.size(); }
  double fine_cells_in_one() const { return cells_; }

  std::vector<double> of(std::span<const double> values) const {
    std::vector<double> out(size(), 0.0);
    for_each([&](std::size_t c, std::size_t f, double share) { out[c] += share * values[f]; });
    return out;
  }

 private:
  int width_;
  AxisTerms columns_;
  AxisTerms rows_;
  double cells_;
};

ChannelIllumination coarsened(const ChannelIllumination& fine,
                              const FaceMeans& lit,
                              const FaceMeans& seen) {
  ChannelIllumination out{lit.of(fine.irradiance),
                          std::vector<double>(seen.size(), 0.0),
                          std::vector<double>(seen.size(), 0.0),
                          0.0};
  std::vector<double> usable(seen.size(), 0.0);
  seen.for_each([&](std::size_t c, std::size_t f, double share) {
    if (fine.weight[f] == 0.0) return;
    usable[c] += share;
    out.radiance[c] += share * fine.radiance[f];
    out.weight[c] += share * seen.fine_cells_in_one() * fine.weight[f];
  });
  for (std::size_t c = 0; c < usable.size(); ++c)
    if (usable[c] > 0.0) out.radiance[c] /= usable[c];
  return out;
}

std::vector<diffusion::CameraEquation> coarsened(const std::vector<diffusion::CameraEquation>& fine,
                                                 const FaceMeans& seen) {
  std::vector<diffusion::CameraEquation> out(seen.size());
  seen.for_each([&](std::size_t c, std::size_t f, double share) {
    out[c].source_gain += share * fine[f].source_gain;
    out[c].flux_gain += share * fine[f].flux_gain;
  });
  return out;
}

std::vector<diffusion::CameraRay> coarsened(const std::vector<diffusion::CameraRay>& fine,
                                            const FaceMeans& seen) {
  if (fine.empty()) return {};
  std::vector<diffusion::CameraRay> out(seen.size(), diffusion::CameraRay{0.0, 0.0, 0.0});
  seen.for_each([&](std::size_t c, std::size_t f, double share) {
    out[c].column += share * fine[f].column;
    out[c].row += share * fine[f].row;
    out[c].stretch += share * fine[f].stretch;
  });
  return out;
}

std::array<AxisTerms, 3> for_axes(const Block& from, const Block& to, AxisTerms (*make)(int, int)) {
  return {make(from.nx, to.nx), make(from.ny, to.ny), make(from.nz, to.nz)};
}

}  // namespace

std::optional<Block> coarser_block(const Block& block) {
  const double shortest = std::min({block.hx, block.hy, block.hz});
  std::array<int, 3> cells = block.cells();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (block.spacing()[axis] > 1.5 * shortest) continue;
    cells[axis] = (cells[axis] + 1) / 2;
    if (cells[axis] < kFewestCells) return std::nullopt;
  }
  const Vec3 size = block.size();
  return Block{
      cells[0], cells[1], cells[2], size.x / cells[0], size.y / cells[1], size.z / cells[2]};
}

ChannelProblem coarsened(const ChannelProblem& problem, const Block& coarse) {
  const FaceMeans lit(problem.block, coarse, problem.lit_face);
  const FaceMeans seen(problem.block, coarse, problem.seen_face);
  ChannelProblem out{.block = coarse,
                     .lit_face = problem.lit_face,
                     .seen_face = problem.seen_face,
                     .boundary = problem.boundary,
                     .source = problem.source,
                     .camera = coarsened(problem.camera, seen),
                     .rays = coarsened(problem.rays, seen),
                     .illuminations = {},
                     .data_count = 0,
                     .noise = 0.0};
  for (const ChannelIllumination& fine : problem.illuminations) {
    out.illuminations.push_back(coarsened(fine, lit, seen));
    const auto& weight = out.illuminations.back().weight;
    out.data_count += static_cast<std::size_t>(
        std::count_if(weight.begin(), weight.end(), [](double w) { return w > 0.0; }));
  }
  if (problem.data_count > 0) {
    out.noise = problem.noise * static_cast<double>(out.data_count) /
                static_cast<double>(problem.data_count);
  }
  return out;
}

std::vector<double> restricted(const Block& from, const Block& to, std::span<const double> values) {
  return transferred(for_axes(from, to, means), from, values);
}

std::vector<double> prolonged(const Block& from, const Block& to, std::span<const double> values) {
  return transferred(for_axes(from, to, interpolations), from, values);
}

long solves_on_finer(const Block& coarse, const Block& fine, long solves) {
  return std::lround(
      std::ceil(static_cast<double>(solves) * static_cast<double>(coarse.cell_count()) /
                static_cast<double>(fine.cell_count())));
}

}  // namespace opaline::reconstruct
