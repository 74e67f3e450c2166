#include "reconstruct/fallback_solver.h"

#include <fmt/format.h>

#include <utility>

#include "base/log.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using diffusion::FluenceSolver;
using diffusion::Medium;
using diffusion::SolveOptions;
using diffusion::SolveSummary;

class FallbackSolver final : public FluenceSolver {
 public:
  FallbackSolver(std::unique_ptr<FluenceSolver> first, MakeSolver second)
      : solver_(std::move(first)), second_(std::move(second)) {}

  Result<void> prepare(const Medium& medium) override {
    if (!second_) return solver_->prepare(medium);
    medium_ = medium;
    auto prepared = solver_->prepare(medium);
    if (prepared || !is_device_failure(prepared.error())) return prepared;
    return change(prepared.error());
  }

  Result<SolveSummary> solve(const FieldBatch& b,
                             FieldBatch& phi,
                             const SolveOptions& options,
                             std::stop_token stop) override {
    auto solved = solver_->solve(b, phi, options, stop);
    if (solved || !second_ || !is_device_failure(solved.error())) return solved;
    if (auto changed = change(solved.error()); !changed) return changed.error();
    return solver_->solve(b, phi, options, std::move(stop));
  }

  std::string description() const override {
    return reason_.empty() ? solver_->description()
                           : fmt::format("{} (after {})", solver_->description(), reason_);
  }

 private:
  Result<void> change(const Error& why) {
    log::warning("{}; going on with another back end", why.message);
    reason_ = fmt::format("{} failed: {}", solver_->description(), why.message);
    auto made = std::exchange(second_, nullptr)();
    if (!made) return made.error().in(reason_);
    first_ = std::exchange(solver_, *std::move(made));
    const Medium medium = std::exchange(medium_, {});
    return solver_->prepare(medium);
  }

  std::unique_ptr<FluenceSolver> first_;  // once it failed; engines may live in it
  std::unique_ptr<FluenceSolver> solver_;
  MakeSolver second_;  // empty once it was used
  Medium medium_;      // that the second one would have to prepare
  std::string reason_;
};

}  // namespace

bool is_device_failure(const Error& error) {
  return error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kTimeout;
}

std::unique_ptr<FluenceSolver> make_fallback_solver(std::unique_ptr<FluenceSolver> first,
                                                    MakeSolver second) {
  return std::make_unique<FallbackSolver>(std::move(first), std::move(second));
}

}  // namespace opaline::reconstruct
