#pragma once

#include <filesystem>
#include <stop_token>

#include "base/clock.h"
#include "base/dataset.h"
#include "base/events.h"
#include "base/files.h"
#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"
#include "reconstruct/minimiser.h"
#include "reconstruct/reduction.h"

namespace opaline::reconstruct {

/// What a reconstruction from reduced data works with; all of it outlives the call.
struct ReducedContext {
  diffusion::FluenceSolver& solver;
  EventSink& events;
  const Clock& clock;
  FileOperations* files = nullptr;      ///< null: no checkpoints are kept
  std::filesystem::path checkpoints{};  ///< the directory for them
  InversionEngine* engine = nullptr;    ///< null: every minimisation runs on the solver
};

/// reconstruct_material() on the reduced dataset, with its material put back on the dataset's own grid. Pictures and
/// relighting errors of the result are those of the material as put back, against all that was measured: what was saved
/// is counted. Errors: those of both.
Result<InverseResult> reconstruct_reduced(const Dataset& dataset,
                                          const Reduction& reduction,
                                          const InverseOptions& options,
                                          const ReducedContext& context,
                                          std::stop_token stop);

}  // namespace opaline::reconstruct
