#include "reconstruct/prior.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/ensure.h"
#include "reconstruct/resample.h"

namespace opaline::reconstruct {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// sqrt((2 - delta_k0) / n) cos(pi k x / L) for k < count, at the centres of `cells` equal cells.
MatrixXd cosines(int n, int cells, int count) {
  MatrixXd c(cells, count);
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < cells; ++i)
      c(i, k) =
          std::sqrt((k == 0 ? 1.0 : 2.0) / n) * std::cos(std::numbers::pi * k * (i + 0.5) / cells);
  return c;
}

double eigenvalue(const Block& block, std::size_t axis, int k) {
  const double h = block.spacing()[axis];
  return (2.0 - 2.0 * std::cos(std::numbers::pi * k / block.cells()[axis])) / (h * h);
}

// sum_k s_k c_k(x)^2 over all the cosines of the block, in each of its cells.
std::vector<double> unscaled_variance(const Block& block, const std::vector<double>& s) {
  std::array<MatrixXd, 3> squares;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int n = block.cells()[axis];
    squares[axis] = cosines(n, n, n).array().square();
  }
  return multiply_along_axes(block.cells(), squares, s);
}

}  // namespace

CosinePrior::CosinePrior(const Block& block,
                         const Block& coarse,
                         double length_mm,
                         std::size_t modes)
    : coarse_(coarse),
      cells_ratio_(static_cast<double>(block.cell_count()) /
                   static_cast<double>(coarse.cell_count())) {
  ENSURE(length_mm > 0.0 && modes >= 1);
  const auto n = block.cells();
  std::vector<double> s;
  std::vector<std::pair<double, Mode>> all;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double lambda =
            eigenvalue(block, 0, i) + eigenvalue(block, 1, j) + eigenvalue(block, 2, k);
        const double root = 1.0 / (1.0 / (length_mm * length_mm) + lambda);
        s.push_back(root * root);
        if (i < coarse.nx && j < coarse.ny && k < coarse.nz)
          all.push_back({lambda, {{i, j, k}, root}});
      }
  modes = std::min(modes, all.size());
  std::nth_element(all.begin(),
                   all.begin() + static_cast<std::ptrdiff_t>(modes) - 1,
                   all.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t m = 0; m < modes; ++m) kept_.push_back(all[m].second);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int cells = coarse.cells()[axis];
    points_[axis] = cosines(n[axis], cells, cells);
    means_[axis] = cell_means(n[axis], cells) * cosines(n[axis], n[axis], cells);
  }
  scale_ = average_cells(block, coarse, unscaled_variance(block, s));
  for (double& v : scale_) v = 1.0 / std::sqrt(v);
}

Eigen::VectorXd CosinePrior::deviations(const PriorOptions& options) const {
  Eigen::VectorXd d(size());
  d[0] = options.level;
  for (Index m = 1; m < size(); ++m)
    d[m] = options.amplitude * kept_[static_cast<std::size_t>(m) - 1].root;
  return d;
}

void CosinePrior::project(std::span<const double> field, Eigen::Ref<Eigen::VectorXd> out) const {
  ENSURE(field.size() == coarse_.cell_count() && out.size() == size());
  std::vector<double> scaled(field.begin(), field.end());
  out[0] = 0.0;
  for (std::size_t i = 0; i < scaled.size(); ++i) {
    out[0] += scaled[i];
    scaled[i] *= scale_[i];
  }
  const std::array<MatrixXd, 3> transposed{
      means_[0].transpose(), means_[1].transpose(), means_[2].transpose()};
  const auto spectrum = multiply_along_axes(coarse_.cells(), transposed, std::move(scaled));
  for (std::size_t m = 0; m < kept_.size(); ++m) {
    const auto& k = kept_[m].k;
    out[static_cast<Index>(m) + 1] = spectrum[coarse_.index(k[0], k[1], k[2])];
  }
}

// The cosines are orthogonal on the centres of the coarse cells, which are fewer than those they are normalised on.
std::vector<double> CosinePrior::kept_part(std::span<const double> field) const {
  ENSURE(field.size() == coarse_.cell_count());
  std::vector<double> unscaled(field.begin(), field.end());
  for (std::size_t i = 0; i < unscaled.size(); ++i) unscaled[i] /= scale_[i];
  const std::array<MatrixXd, 3> transposed{
      points_[0].transpose(), points_[1].transpose(), points_[2].transpose()};
  const auto spectrum = multiply_along_axes(coarse_.cells(), transposed, std::move(unscaled));
  std::vector<double> kept(spectrum.size(), 0.0);
  for (const Mode& mode : kept_) {
    const std::size_t at = coarse_.index(mode.k[0], mode.k[1], mode.k[2]);
    kept[at] = spectrum[at] * cells_ratio_;
  }
  kept = multiply_along_axes(coarse_.cells(), points_, std::move(kept));
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] *= scale_[i];
  return kept;
}

MatrixXd CosinePrior::values() const {
  MatrixXd f(static_cast<Index>(coarse_.cell_count()), size());
  f.col(0).setOnes();
  for (Index m = 1; m < size(); ++m) {
    const auto& mode = kept_[static_cast<std::size_t>(m) - 1].k;
    for (int k = 0; k < coarse_.nz; ++k)
      for (int j = 0; j < coarse_.ny; ++j)
        for (int i = 0; i < coarse_.nx; ++i) {
          const std::size_t cell = coarse_.index(i, j, k);
          f(static_cast<Index>(cell), m) = scale_[cell] * points_[0](i, mode[0]) *
                                           points_[1](j, mode[1]) * points_[2](k, mode[2]);
        }
  }
  return f;
}

}  // namespace opaline::reconstruct
