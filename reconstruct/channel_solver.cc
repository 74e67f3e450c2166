#include "reconstruct/channel_solver.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/log.h"
#include "reconstruct/coarse_grid.h"
#include "reconstruct/coarse_start.h"
#include "reconstruct/fallback_solver.h"
#include "reconstruct/published_step.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kStallWindow = 10;  // iterations over which progress is judged

}  // namespace

ChannelSolver::ChannelSolver(const ChannelProblem& problem,
                             const InverseOptions& options,
                             Parametrization parametrization,
                             diffusion::FluenceSolver& solver,
                             const Clock& clock,
                             Hooks hooks,
                             InversionEngine* engine)
    : problem_(problem),
      options_(options),
      parametrization_(std::move(parametrization)),
      solver_(solver),
      clock_(clock),
      hooks_(std::move(hooks)),
      engine_(engine),
      objective_(
          problem, solver, {options.tolerance, options.regularization, options.regularizer}) {}

Bounds ChannelSolver::bounds() const {
  const std::size_t scattering = parametrization_.reduced_scattering().size();
  const std::size_t all = parametrization_.size();
  Bounds b;
  b.lower.assign(scattering, std::log(options_.reduced_scattering.lowest));
  b.upper.assign(scattering, std::log(options_.reduced_scattering.highest));
  b.lower.resize(all, std::log(options_.absorption.lowest));
  b.upper.resize(all, std::log(options_.absorption.highest));
  return b;
}

void ChannelSolver::record(ChannelProgress& progress) {
  const Evaluation& at = progress.state.at;
  ChannelReport& report = progress.report;
  report.solves = solves_before_ + objective_.solves() + (on_engine_ ? on_engine_->solves() : 0);
  report.seconds = seconds_before_ + std::chrono::duration<double>(clock_.now() - start_).count();
  report.history.push_back({static_cast<int>(report.history.size()),
                            at.value,
                            at.chi_squared / static_cast<double>(report.data_count),
                            at.regularization,
                            report.solves});
  hooks_.iterated(report);
}

Result<Evaluation> ChannelSolver::evaluate(std::span<const double> x, std::stop_token stop) {
  auto at = objective_.evaluate(parametrization_.expand(x), std::move(stop));
  if (at) at->gradient = parametrization_.gather(at->gradient);
  return at;
}

Result<ChannelSolver::WarmStart> ChannelSolver::start(std::stop_token stop) const {
  const bool full = parametrization_ == Parametrization::full(problem_.block);
  if (full && options_.coarser_grids > 0 && options_.max_iterations > 0 &&
      options_.method != Method::kAsPublished) {
    if (const auto coarse = coarser_block(problem_.block))
      return coarse_start(
          problem_, *coarse, options_, warm_, try_rivals_, solver_, clock_, std::move(stop));
  }
  if (warm_) return *warm_;
  const auto fit = fit_homogeneous(problem_, options_, solver_, std::move(stop));
  if (!fit) return fit.error().in("homogeneous fit");
  const std::size_t cells = problem_.block.cell_count();
  WarmStart warm{*fit, std::vector<double>(cells, std::log(fit->reduced_scattering)), fit->solves};
  warm.homogeneous.chi_squared = 0.0;  // of a few pictures
  warm.cell_values.resize(2 * cells, std::log(fit->absorption));
  return warm;
}

Result<ChannelProgress> ChannelSolver::begin(std::stop_token stop) {
  auto warm = start(stop);
  if (!warm) return warm.error();
  solves_before_ = warm->solves;
  ChannelProgress progress;
  progress.report.data_count = problem_.data_count;
  const double noise = problem_.noise / static_cast<double>(problem_.data_count);
  progress.report.noise_per_datum = noise;
  progress.report.target_per_datum = noise + options_.discrepancy * (1.0 - noise);
  progress.state.x = parametrization_.average(warm->cell_values);
  auto at = evaluate(progress.state.x, stop);
  if (!at) return at.error();
  progress.state.at = *std::move(at);
  progress.state.pairs = std::move(warm->pairs);
  if (warm->homogeneous.chi_squared == 0.0)
    warm->homogeneous.chi_squared = progress.state.at.chi_squared;
  progress.report.homogeneous = warm->homogeneous;
  record(progress);
  return progress;
}

std::optional<StopReason> ChannelSolver::reason_to_stop(const ChannelReport& report) const {
  const auto& history = report.history;
  const IterationRecord& now = history.back();
  if (now.chi_squared_per_datum <= report.target_per_datum) return StopReason::kDiscrepancy;
  if (now.iteration >= options_.max_iterations) return StopReason::kIterationLimit;
  if (history.size() <= kStallWindow) return std::nullopt;
  const double gained = history[history.size() - 1 - kStallWindow].objective - now.objective;
  if (gained < options_.stalled * now.objective) return StopReason::kStalled;
  return std::nullopt;
}

Result<StepOutcome> ChannelSolver::step(LbfgsState& state,
                                        const Bounds& box,
                                        std::stop_token stop) {
  if (on_engine_) {
    auto outcome = on_engine_->step(std::move(stop));
    if (outcome) state.at = on_engine_->at();
    return outcome;
  }
  const ObjectiveFunction objective = [this](std::span<const double> x, std::stop_token token) {
    return evaluate(x, std::move(token));
  };
  if (options_.method == Method::kLbfgs) {
    return lbfgs_step(state, box, {}, objective, std::move(stop));
  }
  if (options_.method == Method::kGaussNewton) {
    auto product = hessian(state.x, stop);
    if (!product) return product.error();
    return gauss_newton_step(state, box, {}, objective, *product, std::move(stop));
  }
  const auto value = [this](std::span<const double> x, std::stop_token token) {
    return objective_.value(parametrization_.expand(x), std::move(token));
  };
  return published_step(state, box, {objective, value}, std::move(stop));
}

Result<void> ChannelSolver::begin_on_engine(const ChannelProgress& progress) {
  const bool every_cell =
      parametrization_.reduced_scattering().is_full() && parametrization_.absorption().is_full();
  if (engine_ == nullptr || !every_cell) return ok();
  auto begun = engine_->begin(problem_, options_, progress.state);
  if (!begun && !is_device_failure(begun.error())) return begun.error();
  if (!begun) {
    log::warning("{}; minimising outside the device", begun.error().message);
    return ok();
  }
  on_engine_ = *std::move(begun);
  read_back_ = progress;
  return ok();
}

Result<void> ChannelSolver::read_back(ChannelProgress& progress) {
  if (!on_engine_) return ok();
  auto state = on_engine_->state();
  if (!state) return state.error();
  progress.state = *std::move(state);
  read_back_ = progress;
  return ok();
}

// P^T H P at x.
Result<HessianProduct> ChannelSolver::hessian(std::span<const double> x,
                                              const std::stop_token& stop) {
  auto tangent = objective_.tangent(parametrization_.expand(x), stop);
  if (!tangent) return tangent.error();
  return HessianProduct(
      [this, at = std::make_shared<Tangent>(*std::move(tangent))](
          std::span<const double> v, const std::stop_token& token) -> Result<std::vector<double>> {
        const auto product = objective_.hessian_product(*at, parametrization_.expand(v), token);
        if (!product) return product.error();
        return parametrization_.gather(*product);
      });
}

Result<void> ChannelSolver::iterate(ChannelProgress& progress, std::stop_token stop) {
  const Bounds box = bounds();
  for (;;) {
    if (const auto reason = reason_to_stop(progress.report)) {
      progress.report.stop_reason = *reason;
      return read_back(progress);
    }
    const auto outcome = step(progress.state, box, stop);
    if (!outcome) return outcome.error();
    if (*outcome == StepOutcome::kNoDescent) {
      progress.report.stop_reason = StopReason::kNoDescent;
      return read_back(progress);
    }
    record(progress);
    if (progress.report.history.back().iteration % options_.checkpoint_every != 0) continue;
    if (auto read = read_back(progress); !read) return read;
    if (auto saved = hooks_.checkpoint(progress); !saved) return saved;
    objective_.start_afresh();
    if (on_engine_) on_engine_->start_afresh();
  }
}

Result<ChannelProgress> ChannelSolver::run(std::optional<ChannelProgress> from,
                                           std::stop_token stop) {
  start_ = clock_.now();
  if (from) {
    solves_before_ = from->report.solves;
    seconds_before_ = from->report.seconds;
  } else {
    auto begun = begin(stop);
    if (!begun) return begun.error();
    from = *std::move(begun);
  }
  if (auto begun = begin_on_engine(*from); !begun) return begun.error();
  auto done = iterate(*from, stop);
  if (!done && on_engine_ && is_device_failure(done.error())) {
    log::warning("{}; going on without the device from iteration {}",
                 done.error().message,
                 read_back_.report.history.back().iteration);
    solves_before_ += on_engine_->solves();
    on_engine_.reset();
    *from = read_back_;
    done = iterate(*from, stop);
  }
  if (!done) return done.error();
  return *std::move(from);
}

}  // namespace opaline::reconstruct
