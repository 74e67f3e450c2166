#include "reconstruct/solve_check.h"

#include <fmt/format.h>

namespace opaline::reconstruct {
namespace {

constexpr double kUselessResidual = 1e-3;

}  // namespace

Result<void> check_useful(const diffusion::SolveSummary& summary) {
  if (summary.termination == diffusion::Termination::kCancelled)
    return cancelled("diffusion solve");
  if (summary.relative_residual < kUselessResidual) return ok();
  return internal_error(fmt::format("diffusion solve stopped at a relative residual of {:.1e}: {}",
                                    summary.relative_residual,
                                    summary.message));
}

}  // namespace opaline::reconstruct
