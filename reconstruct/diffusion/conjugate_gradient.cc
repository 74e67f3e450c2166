#include "reconstruct/diffusion/conjugate_gradient.h"

#include <fmt/format.h>

#include <limits>

namespace opaline::reconstruct::diffusion {
namespace {

const char* in_words(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return "converged";
    case Termination::kIterationLimit:
      return "stopped at the iteration limit";
    case Termination::kBreakdown:
      return "made no further progress";
    case Termination::kCancelled:
      return "cancelled";
  }
  return "stopped";
}

}  // namespace

double worst_ratio(std::span<const double> norms, std::span<const double> references) {
  double worst = 0.0;
  for (std::size_t m = 0; m < norms.size(); ++m) {
    if (std::isnan(norms[m])) return std::numeric_limits<double>::infinity();
    if (norms[m] != 0.0) worst = std::max(worst, norms[m] / references[m]);
  }
  return std::sqrt(worst);
}

SolveSummary summarise(Termination termination, int iterations, double relative_residual) {
  return {termination,
          iterations,
          relative_residual,
          fmt::format("{} after {} iterations, relative residual {:.2e}",
                      in_words(termination),
                      iterations,
                      relative_residual)};
}

}  // namespace opaline::reconstruct::diffusion
