#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/objective.h"

namespace opaline::reconstruct {

/// Where a coefficient lies in 95 of 100 measurements like this one, 1/mm.
struct Interval {
  double lowest = 0.0;
  double highest = 0.0;
  bool operator==(const Interval&) const = default;
};

/// The homogeneous sample that explains the pictures of one channel best.
struct HomogeneousFit {
  double reduced_scattering = 0.0;  ///< 1/mm
  double absorption = 0.0;          ///< 1/mm
  double chi_squared = 0.0;         ///< over all illuminations
  int iterations = 0;
  long solves = 0;  ///< for one right-hand side
  /// Only where the homogeneous sample is the answer.
  std::optional<Interval> reduced_scattering_interval = {};
  std::optional<Interval> absorption_interval = {};
  /// Other minima, at most twice as high: where veins make most of chi^2, homogeneous samples do not tell which of them
  /// the veins are about (reconstruct/coarse_start.h does). Lowest first.
  std::vector<StartCoefficients> rivals = {};
};

/// Fits (log sigma_s', log sigma_a) of a homogeneous block by Levenberg-Marquardt with central
/// differences, from ChannelProblem::start or the best of a coarse table of optical thicknesses and albedos, which is
/// sought on a coarser grid of the block where there are many cells. Two numbers need few pictures: four of the illuminations, spread over all of them, lead to the start of
/// another fit; refine_homogeneous() has the last word where the homogeneous sample is the answer, as it is with
/// max_iterations = 0. Absorption that the pictures cannot tell from none stays at its lower bound.
/// Errors: the objective's.
Result<HomogeneousFit> fit_homogeneous(const ChannelProblem& problem,
                                       const InverseOptions& options,
                                       diffusion::FluenceSolver& solver,
                                       std::stop_token stop);

/// The fit to all illuminations from a start, with 95 % intervals from the Gauss-Newton covariance
///
///   C = H^-1 [ J^T W V W J + sum_k (J^T W e_k) (J^T W e_k)^T ] H^-1,   H = J^T W J,
///
/// J = dL/d(log sigma_s', sigma_a), W the weights, V the measured variance: what the noise of this measurement makes of
/// these weights. e_1 = model_error L and e_2 = model_error l (l as in InverseOptions::model_error) are the model's error
/// were it the same in every picture, which is the worst it can be: it does not average out. Scattering is log-normal
/// (it is positive), absorption normal and cut at 0, so that absorption that cannot be told from none has an interval
/// too. Equations: Seber & Wild, Nonlinear Regression (1989), sec. 2.1 and 12.2.
Result<HomogeneousFit> refine_homogeneous(const ChannelProblem& problem,
                                          const InverseOptions& options,
                                          const HomogeneousFit& start,
                                          diffusion::FluenceSolver& solver,
                                          std::stop_token stop);

}  // namespace opaline::reconstruct
