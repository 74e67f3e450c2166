#pragma once

#include <span>

#include "base/block.h"

namespace opaline::reconstruct {

/// First-order smoothness prior on the logarithms of the coefficients (H1), in the units of
/// chi-squared:
///
///   R(u) = lambda / 2 sum_faces(ij) a / (h l) (u_i - u_j)^2,   u = log kappa and u = log sigma_a
///
/// a, h: area of the face and distance of the two centres; l: the block's smallest extent. It is
/// the log-density of a Gaussian prior beside the 1/2 chi^2 of the data, so it needs no scaling by
/// the number of data or their magnitude; a / (h l) makes it independent of the grid's resolution
/// (the sum tends to 1/l int |grad u|^2 dV) and of the unit of length.
class Regularizer {
 public:
  Regularizer(const Block& block, double lambda);
  /// R(u); adds dR/du to `gradient`. `u` holds one value a cell.
  double add(std::span<const double> u, std::span<double> gradient) const;

 private:
  double add_axis(std::size_t axis, std::span<const double> u, std::span<double> gradient) const;
  Block block_;
  double lambda_;
  double length_;
};

}  // namespace opaline::reconstruct
