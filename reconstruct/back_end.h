#pragma once

#include <memory>

#include "base/result.h"
#include "gpu/context.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/minimiser.h"

namespace opaline::reconstruct {

/// The diffusion solver, and the engine for whole minimisations, that the options ask for.
///
///   auto    a Vulkan device that is not a CPU, else host; when that device fails, host
///   vulkan  any Vulkan device; when there is none or it fails, host where options.back_end_fallback allows it
///
/// Errors: kUnavailable when this build or machine has no such back end and no other is allowed.
/// `engine` lives in the solver; null where the back end has none. A minimisation that fails on it goes on with the solver
/// (reconstruct/channel_solver.h).
struct BackEndParts {
  std::unique_ptr<diffusion::FluenceSolver> solver;
  InversionEngine* engine = nullptr;
};
Result<BackEndParts> make_back_end(const InverseOptions& options,
                                   const gpu::ContextOptions& gpu = {});

/// The solver alone.
Result<std::unique_ptr<diffusion::FluenceSolver>> make_solver(const InverseOptions& options,
                                                              const gpu::ContextOptions& gpu = {});

}  // namespace opaline::reconstruct
