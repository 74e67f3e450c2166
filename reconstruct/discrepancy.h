#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruct/channel_problem.h"

namespace opaline::reconstruct {

/// The part of the model's error that is smooth over a picture: what diffusion or a grid gets wrong about one light is
/// wrong alike in neighbouring cells, so it is not averaged out by their number. After Kennedy & O'Hagan, J. R. Stat.
/// Soc. B 63, 425 (2001), a Gaussian field over the seen face, partly each picture's own, partly the same in all,
///
///   e_m(x) = eps hypot(L_m(x), l_m) sum_k c_k(x) ((1 - s)^(1/2) xi_mk + s^(1/2) xi_k) / K^(1/2),   xi ~ N(0, 1)
///
/// c_k: the K cosines over the face whose half waves are no shorter than `length_mm`, of mean square 1; l: the root
/// mean square of the picture, so that eps compares with InverseOptions::model_error. Against Monte Carlo and finite
/// elements, at the true coefficients, 40 to 65 % of the error's variance is in these shapes, and 8 to 38 % of it the
/// same in all pictures.
class DiscrepancyShapes {
 public:
  static constexpr double kCommonShare = 0.25;  ///< s

  /// At most eight cosines an axis.
  DiscrepancyShapes(const Block& block, Face seen_face, double length_mm);

  Eigen::Index size() const { return cosines_.cols(); }
  /// sqrt(w) e of one picture at eps = 1, data x size(); 0 where masked.
  Eigen::MatrixXd whitened(const ChannelIllumination& picture) const;

 private:
  Eigen::MatrixXd cosines_;  // c_k / sqrt(K), cells of the seen face x K
};

/// Where light is mixed over: the sample's thickness behind its seen face, mm.
double mixing_length(const Block& block, Face seen_face);

}  // namespace opaline::reconstruct
