#pragma once

#include <memory>

#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// The diffusion solver that the options ask for.
/// Errors: kUnavailable when this build or machine has no such back end.
Result<std::unique_ptr<diffusion::FluenceSolver>> make_solver(const InverseOptions& options);

}  // namespace opaline::reconstruct
