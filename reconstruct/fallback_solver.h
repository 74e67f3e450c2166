#pragma once

#include <functional>
#include <memory>

#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct {

/// Whether a device failed, was full or hung, so that another back end can still do the work: kUnavailable, kTimeout.
bool is_device_failure(const Error& error);

using MakeSolver = std::function<Result<std::unique_ptr<diffusion::FluenceSolver>>()>;

/// Solves with `first`; when its device fails, logs why, makes the solver that `second` answers, and goes on with that
/// one, the failed call included: a solve starts again from the fluence as the first solver left it. description()
/// names both, with the reason. `first` lives on to the end, unused.
///
/// Errors: those of `first` that are not a device's, those of `second`.
std::unique_ptr<diffusion::FluenceSolver> make_fallback_solver(
    std::unique_ptr<diffusion::FluenceSolver> first, MakeSolver second);

}  // namespace opaline::reconstruct
