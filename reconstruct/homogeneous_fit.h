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
  double chi_squared = 0.0;         ///< over all illuminations
  int iterations = 0;
  long solves = 0;  ///< for one right-hand side
};

/// Fits (log sigma_s', log sigma_a) of a homogeneous block by Levenberg-Marquardt with central
/// differences, from the best of a coarse table of optical thicknesses and albedos. Two numbers
/// need few pictures: four of the illuminations, spread over all of them, lead to the start of a
/// heterogeneous fit; where the homogeneous sample is the answer (max_iterations = 0) all of them
/// have the last word. Absorption that the pictures cannot tell from none stays at its lower bound.
/// Errors: the objective's.
Result<HomogeneousFit> fit_homogeneous(const ChannelProblem& problem,
                                       const InverseOptions& options,
                                       diffusion::FluenceSolver& solver,
                                       std::stop_token stop);

}  // namespace opaline::reconstruct
