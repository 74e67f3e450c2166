#pragma once

#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct {

/// Whether a solve's answer says something about the medium: its relative residual is below 1e-3.
/// Errors: kCancelled; kInternal when it stays above, with the solver's own words.
Result<void> check_useful(const diffusion::SolveSummary& summary);

}  // namespace opaline::reconstruct
