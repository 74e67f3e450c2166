#pragma once

#include <stop_token>

#include "base/result.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/objective.h"

namespace opaline::reconstruct {

/// The homogeneous sample that explains the pictures of one channel best.
struct HomogeneousFit {
  double reduced_scattering = 0.0;  ///< 1/mm
  double absorption = 0.0;          ///< 1/mm
  double chi_squared = 0.0;
  int iterations = 0;
};

/// Fits (log sigma_s', log sigma_a) of a homogeneous block by Levenberg-Marquardt with forward
/// differences, from the best of a coarse table of optical thicknesses and albedos. Absorption that
/// the pictures cannot tell from none stays at its lower bound. Errors: the objective's.
Result<HomogeneousFit> fit_homogeneous(const ChannelProblem& problem,
                                       const InverseOptions& options,
                                       Objective& objective,
                                       std::stop_token stop);

}  // namespace opaline::reconstruct
