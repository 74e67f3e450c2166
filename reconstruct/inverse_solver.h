#pragma once

#include <stop_token>

#include "base/clock.h"
#include "base/dataset.h"
#include "base/events.h"
#include "base/result.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"
#include "reconstruct/minimiser.h"

namespace opaline::reconstruct {

/// What a reconstruction works with; all of it outlives the call.
struct InverseContext {
  diffusion::FluenceSolver& solver;
  EventSink& events;
  const Clock& clock;
  const CheckpointStore* checkpoints = nullptr;  ///< null: none are kept
  InversionEngine* engine = nullptr;             ///< null: every minimisation runs on the solver
};

/// Recovers sigma_a and sigma_s' per cell and channel from pictures of a lit sample
/// (docs/physics.md):
///
///   per channel: up the ladder of models (reconstruct/model_ladder.h) as far as the held-out pictures ask for, on each
///   L-BFGS, or the options' method, on Objective over the model's (log sigma_s', log sigma_a), bounded, the cells' from
///   coarse to fine (reconstruct/coarse_start.h), until chi^2 is what the measured noise makes of it (Morozov 1966, InverseOptions::discrepancy), or no more is
///   to be had
///
/// A cancelled or killed call goes on from its last checkpoint. After each checkpoint the solves
/// start afresh, so a run that was interrupted gives the same bits as one that was not, on the same
/// solver.
///
/// Events:  progress "homogeneous fit" and "reconstruction" {channel, iteration, objective,
/// chi_squared_per_datum};
///          fact "channel.reconstructed" {channel, model, iterations, chi_squared_per_datum, stop_reason,
///          seconds}; fact "checkpoint.saved" {iteration}, at most every ten seconds.
/// Threads: one call at a time per solver.
/// Errors:  kInvalidArgument for options or a dataset that cannot be used; kCancelled; the
/// solver's; kUnavailable when
///          a checkpoint cannot be written. Not reaching the noise is an answer:
///          ChannelReport::stop_reason.
Result<InverseResult> reconstruct_material(const Dataset& dataset,
                                           const InverseOptions& options,
                                           const InverseContext& context,
                                           std::stop_token stop);

}  // namespace opaline::reconstruct
