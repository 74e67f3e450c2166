#pragma once

#include <stop_token>
#include <string>

#include "base/dataset.h"
#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/model_choice.h"

namespace opaline::reconstruct {

/// Which source the pictures ask for (docs/physics.md, "How light enters"): light that is diffuse when it enters, at the
/// surface, or a beam that scatters on its way in.
struct SourceChoice {
  diffusion::SourceModel model = diffusion::SourceModel::kSurface;
  double surface = 0.0;     ///< chi^2 per judging datum of the homogeneous sample, surface source
  double collimated = 0.0;  ///< the same, collimated source
  Gain gain;                ///< of the collimated one
  std::string why;          ///< one sentence
};

/// The homogeneous sample of the green channel is fitted with either source, and judged by the held-out lights (by all where
/// there is none). The surface source is the simpler; the collimated one is taken where its gain exceeds its standard
/// error. Where the lit face is seen, cells near directly lit ones are left out first.
/// Errors: make_channel_problem()'s, the solver's; kCancelled.
Result<SourceChoice> choose_source(const Dataset& dataset,
                                   const InverseOptions& options,
                                   diffusion::FluenceSolver& solver,
                                   std::stop_token stop);

}  // namespace opaline::reconstruct
