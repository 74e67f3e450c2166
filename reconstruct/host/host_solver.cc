#include "reconstruct/host/host_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <thread>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/medium_check.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/host/host_passes.h"

namespace opaline::reconstruct::host {
namespace {

using diffusion::FieldBatch;
using diffusion::Medium;
using diffusion::SolveOptions;
using diffusion::SolveSummary;
using diffusion::Termination;

constexpr std::array kWidths{1, 4, 8, 16};

int thread_count(const HostOptions& options) {
  if (options.threads > 0) return options.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// The summary of all groups: the worst end, the most iterations.
void merge(SolveSummary& all, const SolveSummary& group) {
  const bool worse =
      all.termination == Termination::kConverged || group.relative_residual > all.relative_residual;
  const int iterations = std::max(all.iterations, group.iterations);
  if (worse && !(group.termination == Termination::kConverged &&
                 group.relative_residual < all.relative_residual))
    all = group;
  all.iterations = iterations;
}

class HostSolver final : public diffusion::FluenceSolver {
 public:
  explicit HostSolver(const HostOptions& options) : team_(thread_count(options)) {}

  Result<void> prepare(const Medium& medium) override {
    if (Result<void> good = validate(medium); !good) return good;
    block_ = medium.block;
    grid_ = build_host_grid(medium);
    for (auto& work : work_)
      if (work && !work->fits(*grid_)) work.reset();
    return ok();
  }

  Result<SolveSummary> solve(const FieldBatch& b,
                             FieldBatch& phi,
                             const SolveOptions& options,
                             std::stop_token stop) override {
    if (!grid_) return invalid_argument("solve before a successful prepare");
    if (Result<void> good = validate(options); !good) return good.error();
    if (Result<void> good = check_fields(block_, b, phi); !good) return good.error();
    const std::vector<double> norms = diffusion::norms_and_trivial(b, phi);
    const bool dark =
        std::all_of(phi.values.begin(), phi.values.end(), [](double v) { return v == 0.0; });
    SolveSummary all{Termination::kConverged, 0, 0.0, "no right-hand side"};
    for (int first = 0; first < b.count; first += kWidths.back()) {
      const int count = std::min(kWidths.back(), b.count - first);
      const Group group{b, phi, first, count, std::span(norms).subspan(first, count), dark};
      const SolveSummary summary = solve_group(group, options, stop);
      if (summary.termination == Termination::kCancelled) return cancelled(summary.message);
      merge(all, summary);
    }
    return all;
  }

  std::string description() const override {
    return fmt::format("host, {} threads, {}", team_.size(), instruction_set());
  }

 private:
  SolveSummary solve_group(const Group& group,
                           const SolveOptions& options,
                           const std::stop_token& stop) {
    const auto at = std::lower_bound(kWidths.begin(), kWidths.end(), group.count) - kWidths.begin();
    std::optional<Workspace>& work = work_[at];
    if (!work) work.emplace(*grid_, kWidths[at], team_.size());
    HostPasses passes(team_, *grid_, *work, group);
    return conjugate_gradient(passes, group.b_norms, options, stop);
  }

  ThreadTeam team_;
  Block block_;
  std::optional<HostGrid> grid_;
  std::array<std::optional<Workspace>, kWidths.size()> work_;
};

}  // namespace

Result<void> validate(const HostOptions& options) {
  if (options.threads < 0 || options.threads > 1024)
    return invalid_argument(
        fmt::format("threads = {}; expected 0 (every core) to 1024", options.threads));
  return ok();
}

std::unique_ptr<diffusion::FluenceSolver> make_host_solver(const HostOptions& options) {
  return std::make_unique<HostSolver>(options);
}

}  // namespace opaline::reconstruct::host
