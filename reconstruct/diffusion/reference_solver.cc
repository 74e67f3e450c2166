#include "reconstruct/diffusion/reference_solver.h"

#include <algorithm>
#include <numeric>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/medium_check.h"
#include "reconstruct/diffusion/reference_passes.h"

namespace opaline::reconstruct::diffusion {
namespace {

class ReferenceSolver final : public FluenceSolver {
 public:
  Result<void> prepare(const Medium& medium) override {
    if (Result<void> good = validate(medium); !good) return good;
    block_ = medium.block;
    levels_ = build_levels(medium);
    return ok();
  }

  Result<SolveSummary> solve(const FieldBatch& b,
                             FieldBatch& phi,
                             const SolveOptions& options,
                             std::stop_token stop) override {
    if (levels_.empty()) return invalid_argument("solve before a successful prepare");
    if (Result<void> good = validate(options); !good) return good.error();
    if (Result<void> good = check_fields(block_, b, phi); !good) return good.error();
    const std::vector<double> norms = norms_and_trivial(b, phi);
    ReferencePasses passes(levels_, b, phi);
    SolveSummary summary = conjugate_gradient(passes, norms, options, stop);
    if (summary.termination == Termination::kCancelled) return cancelled(summary.message);
    return summary;
  }

  std::string description() const override { return "reference, 1 thread, float64"; }

 private:
  Block block_;
  std::vector<Level> levels_;
};

}  // namespace

std::unique_ptr<FluenceSolver> make_reference_solver() {
  return std::make_unique<ReferenceSolver>();
}

std::vector<double> norms_and_trivial(const FieldBatch& b, FieldBatch& phi) {
  std::vector<double> norms(b.count, 0.0);
  for (int m = 0; m < b.count; ++m) {
    const double* f = b.field(m);
    norms[m] = std::inner_product(f, f + b.cells, f, 0.0);
    if (norms[m] == 0.0) std::fill(phi.field(m), phi.field(m) + phi.cells, 0.0);
  }
  return norms;
}

}  // namespace opaline::reconstruct::diffusion
