#include "reconstruct/grid_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/objective.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kAtOnce = 16;  // illuminations whose fine fields are in memory together

Block refined(const Block& b) {
  return {2 * b.nx, 2 * b.ny, 2 * b.nz, b.hx / 2.0, b.hy / 2.0, b.hz / 2.0};
}

// Each cell becomes eight of the same value.
std::vector<double> refined(const Block& block, const std::vector<double>& field) {
  const Block fine = refined(block);
  std::vector<double> out;
  out.reserve(fine.cell_count());
  for (int k = 0; k < fine.nz; ++k)
    for (int j = 0; j < fine.ny; ++j)
      for (int i = 0; i < fine.nx; ++i) out.push_back(field[block.index(i / 2, j / 2, k / 2)]);
  return out;
}

// Each sample of a face becomes 2 x 2 of the same value.
template <class T>
std::vector<T> refined(const std::vector<T>& raster, int width) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<T> fine;
  fine.reserve(4 * raster.size());
  for (std::size_t row = 0; row < 2 * raster.size() / std::max<std::size_t>(w, 1); ++row)
    for (std::size_t column = 0; column < 2 * w; ++column)
      fine.push_back(raster[row / 2 * w + column / 2]);
  return fine;
}

// Means over 2 x 2, of a face `width` wide after that.
std::vector<double> coarsened(const std::vector<double>& fine, int width) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<double> means(fine.size() / 4, 0.0);
  for (std::size_t s = 0; s < fine.size(); ++s)
    means[s / (2 * w) / 2 * w + s % (2 * w) / 2] += 0.25 * fine[s];
  return means;
}

// The light and the camera of some illuminations, without data.
ChannelProblem refined(const ChannelProblem& problem, std::size_t first, std::size_t count) {
  const int lit = problem.block.face_width(problem.lit_face);
  const int seen = problem.block.face_width(problem.seen_face);
  ChannelProblem fine{.block = refined(problem.block),
                      .lit_face = problem.lit_face,
                      .seen_face = problem.seen_face,
                      .boundary = problem.boundary,
                      .source = problem.source,
                      .camera = refined(problem.camera, seen),
                      .rays = refined(problem.rays, seen),
                      .illuminations = {}};
  for (std::size_t m = first; m < first + count; ++m) {
    ChannelIllumination light;
    light.irradiance = refined(problem.illuminations[m].irradiance, lit);
    fine.illuminations.push_back(std::move(light));
  }
  return fine;
}

}  // namespace

Result<GridCorrection> grid_correction(const ChannelProblem& problem,
                                       const ChannelCoefficients& coefficients,
                                       double tolerance,
                                       diffusion::FluenceSolver& solver,
                                       const std::stop_token& stop) {
  GridCorrection correction;
  Objective own(problem, solver, {tolerance, 0.0});
  auto coarse = own.predict(coefficients, stop);
  if (!coarse) return coarse.error();
  correction.predicted = *std::move(coarse);
  correction.solves = own.solves();
  const ChannelCoefficients cut{refined(problem.block, coefficients.absorption),
                                refined(problem.block, coefficients.reduced_scattering)};
  const std::size_t all = problem.illuminations.size();
  for (std::size_t first = 0; first < all; first += kAtOnce) {
    const ChannelProblem some = refined(problem, first, std::min(kAtOnce, all - first));
    Objective finer(some, solver, {tolerance, 0.0});
    const auto fine = finer.predict(cut, stop);
    if (!fine) return fine.error().in("the grid of half the cells");
    correction.solves += 8 * finer.solves();
    for (std::size_t m = 0; m < fine->size(); ++m) {
      const auto mean = coarsened((*fine)[m], problem.block.face_width(problem.seen_face));
      std::vector<double> change = correction.predicted[first + m];
      for (std::size_t x = 0; x < change.size(); ++x) change[x] = 4.0 / 3.0 * (mean[x] - change[x]);
      correction.change.push_back(std::move(change));
    }
  }
  return correction;
}

ChannelProblem corrected(ChannelProblem problem, const GridCorrection& correction) {
  for (std::size_t m = 0; m < correction.change.size(); ++m)
    for (std::size_t x = 0; x < correction.change[m].size(); ++x)
      problem.illuminations[m].radiance[x] -= correction.change[m][x];
  return problem;
}

double CorrectionPower::relative() const {
  return pictures > 0.0 ? std::sqrt(change / pictures) : 0.0;
}

CorrectionPower power(const ChannelProblem& problem, const GridCorrection& correction) {
  CorrectionPower sum;
  for (std::size_t m = 0; m < correction.change.size(); ++m)
    for (std::size_t x = 0; x < correction.change[m].size(); ++x) {
      if (problem.illuminations[m].weight[x] == 0.0) continue;
      const double delta = correction.change[m][x];
      sum.change += delta * delta;
      sum.pictures += std::pow(correction.predicted[m][x] + delta, 2);
    }
  return sum;
}

bool corrects_grid(const InverseOptions& options, const Block& block) {
  return options.grid_correction && options.structure == Structure::kSeparate &&
         options.method != Method::kAsPublished && block.cell_count() <= kMostCorrectedCells;
}

}  // namespace opaline::reconstruct
