#include "reconstruct/host/host_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <thread>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/medium_check.h"
#include "reconstruct/host/host_passes.h"

namespace opaline::reconstruct::host {
namespace {

using diffusion::FieldBatch;
using diffusion::Medium;
using diffusion::Precision;
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

/// The sum of f over the values, in four chains so that additions overlap.
template <class F>
double sum_of(const double* values, std::size_t count, F f) {
  std::array<double, 4> sums{};
  std::size_t n = 0;
  for (; n + 4 <= count; n += 4)
    for (std::size_t chain = 0; chain < 4; ++chain) sums[chain] += f(values[n + chain]);
  for (; n < count; ++n) sums[0] += f(values[n]);
  return sums[0] + sums[1] + sums[2] + sums[3];
}

template <class T, class S>
class HostSolver final : public diffusion::FluenceSolver {
 public:
  explicit HostSolver(const HostOptions& options)
      : team_(thread_count(options)), precision_(options.precision) {}

  Result<void> prepare(const Medium& medium) override {
    if (Result<void> good = validate(medium); !good) return good;
    block_ = medium.block;
    if (!grid_) grid_.emplace();
    build_host_grid(medium, team_, *grid_);
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
    if (Result<void> good = check_shapes(block_, b, phi); !good) return good.error();
    const Survey seen = survey(b, phi);
    if (!seen.finite) {
      if (Result<void> good = check_fields(block_, b, phi); !good) return good.error();
      return invalid_argument("a right-hand side's norm is out of range");
    }
    SolveSummary all{Termination::kConverged, 0, 0.0, "no right-hand side"};
    for (int first = 0; first < b.count; first += kWidths.back()) {
      const int count = std::min(kWidths.back(), b.count - first);
      const Group group{
          b, phi, first, count, std::span(seen.norms).subspan(first, count), seen.dark};
      const SolveSummary summary = solve_group(group, options, stop);
      if (summary.termination == Termination::kCancelled) return cancelled(summary.message);
      merge(all, summary);
    }
    return all;
  }

  std::string description() const override {
    return fmt::format("host, {} threads, {}, {} precision",
                       team_.size(),
                       instruction_set(),
                       to_string(precision_));
  }

 private:
  /// What one look at all values tells.
  struct Survey {
    std::vector<double> norms;  ///< ||b||^2
    bool finite = true;
    bool dark = true;  ///< phi is zero, everywhere
  };

  /// Also sets phi to zero where b is: there the answer is known.
  Survey survey(const FieldBatch& b, FieldBatch& phi) {
    Survey seen{std::vector<double>(b.count, 0.0)};
    std::vector<double> light(b.count, 0.0);
    team_.run([&](int thread) {
      for (int m = thread; m < b.count; m += team_.size()) {
        seen.norms[m] = sum_of(b.field(m), b.cells, [](double v) { return v * v; });
        light[m] = sum_of(phi.field(m), phi.cells, [](double v) { return std::abs(v); });
        if (seen.norms[m] == 0.0 && light[m] > 0.0) std::fill_n(phi.field(m), phi.cells, 0.0);
      }
    });
    for (int m = 0; m < b.count; ++m) {
      seen.finite = seen.finite && std::isfinite(seen.norms[m]) && std::isfinite(light[m]);
      seen.dark = seen.dark && light[m] == 0.0;
    }
    return seen;
  }

  SolveSummary solve_group(const Group& group,
                           const SolveOptions& options,
                           const std::stop_token& stop) {
    const auto at = std::lower_bound(kWidths.begin(), kWidths.end(), group.count) - kWidths.begin();
    std::optional<Workspace<T, S>>& work = work_[at];
    if (!work) work.emplace(*grid_, kWidths[at], team_.size());
    HostPasses<T, S> passes(team_, *grid_, *work, group);
    return conjugate_gradient(passes, group.b_norms, options, stop);
  }

  ThreadTeam team_;
  Precision precision_;
  Block block_;
  std::optional<HostGrid<T>> grid_;
  std::array<std::optional<Workspace<T, S>>, kWidths.size()> work_;
};

}  // namespace

Result<void> validate(const HostOptions& options) {
  if (options.threads < 0 || options.threads > 1024)
    return invalid_argument(
        fmt::format("threads = {}; expected 0 (every core) to 1024", options.threads));
  return ok();
}

std::unique_ptr<diffusion::FluenceSolver> make_host_solver(const HostOptions& options) {
  switch (options.precision) {
    case Precision::kHalf:
      return std::make_unique<HostSolver<float, Half>>(options);
    case Precision::kDouble:
      return std::make_unique<HostSolver<double, double>>(options);
    case Precision::kSingle:
      break;
  }
  return std::make_unique<HostSolver<float, float>>(options);
}

}  // namespace opaline::reconstruct::host
