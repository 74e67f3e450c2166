#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "base/block.h"
#include "reconstruct/posterior.h"

namespace opaline::reconstruct {

/// A proper Gaussian on a field over a block,
///
///   u(x) = level xi_0 + amplitude D(x) sum_k s_k^(1/2) c_k(x) xi_k,   xi ~ N(0, 1),
///   s_k ~ (1/l^2 + lambda_k)^-2
///
/// c_k: the cosines, eigenfunctions of the Laplacian under Neumann conditions, lambda_k their
/// eigenvalues on the block's cells. The square of the elliptic operator makes this a Matern field
/// of covariance e^(-r/l) (Lindgren, Rue & Lindstroem, J. R. Stat. Soc. B 73, 423 (2011), sec.
/// 2.3); D takes out what Neumann conditions add to the variance near the faces, so that it is
/// level^2 + amplitude^2 in every cell. The regulariser's squared gradient alone would be improper
/// (no level) and, in three dimensions, as rough as the cells are small.
///
/// The cosines of least lambda are kept explicitly, for fields on a coarser grid over the same
/// block; nobody learns of the others. Coordinates: the level, then the kept cosines.
/// Threads: const calls are safe together.
class CosinePrior {
 public:
  /// `modes` cosines of `block` on `coarse`, whose cells they must resolve: fewer are taken where
  /// there are fewer.
  CosinePrior(const Block& block, const Block& coarse, double length_mm, std::size_t modes);

  Eigen::Index size() const { return static_cast<Eigen::Index>(kept_.size()) + 1; }
  /// Standard deviation of each coordinate's multiple of its unscaled cosine.
  Eigen::VectorXd deviations(const PriorOptions& options) const;
  /// sum over coarse cells of `field` times each unscaled cosine's cell mean: F^T field.
  void project(std::span<const double> field, Eigen::Ref<Eigen::VectorXd> out) const;
  /// The part of a field on the coarse grid, less its mean, that the kept cosines make up.
  std::vector<double> kept_part(std::span<const double> field) const;
  /// The unscaled cosines at the centres of the coarse cells, cells x size().
  Eigen::MatrixXd values() const;

 private:
  struct Mode {
    std::array<int, 3> k{};
    double root = 0.0;  // s^(1/2)
  };
  Block coarse_;
  double cells_ratio_;
  std::array<Eigen::MatrixXd, 3> points_;  // per axis: cosines at the centres, cells x modes
  std::array<Eigen::MatrixXd, 3> means_;   // over the cells
  std::vector<Mode> kept_;
  std::vector<double> scale_;  // D on the coarse cells
};

}  // namespace opaline::reconstruct
