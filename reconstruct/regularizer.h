#pragma once

#include <span>
#include <vector>

#include "base/block.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// Smoothness prior on the logarithms of the coefficients, u = log kappa and u = log sigma_a, in the units of
/// chi-squared. The log-density of a prior beside the 1/2 chi^2 of the data: it needs no scaling by the number of data
/// or their magnitude.
///
///   kH1:              R(u) = lambda / (2 l) int |grad u|^2 dV                                  (a Gaussian's)
///   kTotalVariation:  R(u) = lambda / l int e^2 (sqrt(1 + |grad u|^2 / e^2) - 1) dV,    e = kEdge / l
///
/// (Rudin, Osher & Fatemi, Physica D 60, 259 (1992), Eq. 2.2, smoothed as by Acar & Vogel, Inverse Problems 10, 1217
/// (1994), Eq. 2.3.) l is the block's smallest extent, which makes lambda a number: neither the unit of length nor the
/// grid matters. Where |grad u| << e the two are the same, so one lambda serves both; where |grad u| >> e, at an edge,
/// the second is lambda e / l times the total variation: an edge costs what its height does, however sharp it is.
///
/// Discretely |grad u|^2 of a cell is the sum over its faces of (u_i - u_j)^2 / (2 h^2), nothing at the surface, so
/// that kH1 is lambda / 2 sum_faces(ij) a / (h l) (u_i - u_j)^2.
///
/// Threads: const calls on one object may run at once.
class Regularizer {
 public:
  /// The logarithm's change over the length l that counts as an edge.
  static constexpr double kEdge = 1.0;

  Regularizer(const Block& block, double lambda, Smoothness kind = Smoothness::kH1);

  /// R(u); adds dR/du to `gradient`. `u` holds one value a cell.
  double add(std::span<const double> u, std::span<double> gradient) const;

  /// Adds H(u) v to `out`, where H is the second derivative, for kTotalVariation without the derivative of its weights
  /// (lagged diffusivity, Vogel & Oman, SIAM J. Sci. Comput. 17, 227 (1996), Eq. 3.2): positive semidefinite.
  void add_product(std::span<const double> u,
                   std::span<const double> v,
                   std::span<double> out) const;
  /// Adds the diagonal of H(u) to `out`.
  void add_diagonal(std::span<const double> u, std::span<double> out) const;

 private:
  template <class Visit>
  void for_faces(Visit visit) const;
  std::vector<double> squared_gradient(std::span<const double> u) const;
  std::vector<double> face_weights(std::span<const double> u) const;

  Block block_;
  double lambda_;
  double length_;
  Smoothness kind_;
};

}  // namespace opaline::reconstruct
