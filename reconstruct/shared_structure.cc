#include "reconstruct/shared_structure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kReference = 1;     // green
constexpr double kLargestScale = 4.0;     // of a channel's variation against green's
constexpr std::size_t kStallWindow = 10;  // iterations over which progress is judged

}  // namespace

SharedPattern::SharedPattern(const Block& block,
                             const std::array<HomogeneousFit, kColorChannels>& homogeneous)
    : cells_(block.cell_count()), weight_(1.0 / std::sqrt(static_cast<double>(cells_))) {
  for (std::size_t c = 0; c < kColorChannels; ++c)
    logs_[c] = {std::log(homogeneous[c].reduced_scattering), std::log(homogeneous[c].absorption)};
}

std::size_t SharedPattern::place(std::size_t channel, std::size_t coefficient) const {
  return 2 * cells_ + (channel == 0 ? 0 : 4) + 2 * coefficient;
}

std::vector<double> SharedPattern::start() const {
  std::vector<double> x(2 * cells_, logs_[kReference][0]);
  std::fill(x.begin() + static_cast<std::ptrdiff_t>(cells_), x.end(), logs_[kReference][1]);
  x.resize(size(), 0.0);
  return x;
}

std::vector<double> SharedPattern::expand(std::span<const double> x, std::size_t channel) const {
  ENSURE(x.size() == size());
  std::vector<double> values(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(2 * cells_));
  if (channel == kReference) return values;
  for (std::size_t u = 0; u < 2; ++u) {
    const double offset = logs_[channel][u] + weight_ * x[place(channel, u)];
    const double scale = 1.0 + weight_ * x[place(channel, u) + 1];
    for (std::size_t i = u * cells_; i < (u + 1) * cells_; ++i)
      values[i] = offset + scale * (values[i] - logs_[kReference][u]);
  }
  return values;
}

void SharedPattern::gather(std::span<const double> x,
                           std::size_t channel,
                           std::span<const double> cell_values,
                           std::span<double> gradient) const {
  for (std::size_t u = 0; u < 2; ++u) {
    const double scale = channel == kReference ? 1.0 : 1.0 + weight_ * x[place(channel, u) + 1];
    double by_offset = 0.0;
    double by_scale = 0.0;
    for (std::size_t i = u * cells_; i < (u + 1) * cells_; ++i) {
      gradient[i] += scale * cell_values[i];
      by_offset += cell_values[i];
      by_scale += cell_values[i] * (x[i] - logs_[kReference][u]);
    }
    if (channel == kReference) continue;
    gradient[place(channel, u)] += weight_ * by_offset;
    gradient[place(channel, u) + 1] += weight_ * by_scale;
  }
}

Bounds SharedPattern::bounds(const InverseOptions& options) const {
  const std::array<CoefficientBounds, 2> of{options.reduced_scattering, options.absorption};
  Bounds box;
  for (const CoefficientBounds& b : of) {
    box.lower.resize(box.lower.size() + cells_, std::log(b.lowest));
    box.upper.resize(box.upper.size() + cells_, std::log(b.highest));
  }
  for (const std::size_t c : {0U, 2U}) {
    for (std::size_t u = 0; u < 2; ++u) {
      box.lower.insert(box.lower.end(),
                       {(std::log(of[u].lowest) - logs_[c][u]) / weight_, -1.0 / weight_});
      box.upper.insert(
          box.upper.end(),
          {(std::log(of[u].highest) - logs_[c][u]) / weight_, (kLargestScale - 1.0) / weight_});
    }
  }
  return box;
}

SharedSolver::SharedSolver(const std::array<ChannelProblem, kColorChannels>& problems,
                           const InverseOptions& options,
                           diffusion::FluenceSolver& solver,
                           const Clock& clock,
                           Hooks hooks)
    : problems_(problems), options_(options), clock_(clock), hooks_(std::move(hooks)) {
  objectives_.reserve(kColorChannels);
  for (const ChannelProblem& problem : problems_) {
    objectives_.emplace_back(
        problem, solver, Objective::Settings{options.tolerance, options.regularization});
  }
}

Result<Evaluation> SharedSolver::evaluate(const SharedPattern& pattern,
                                          std::span<const double> x,
                                          std::stop_token stop) {
  std::array<Evaluation, kColorChannels> of_channels;
  Evaluation sum;
  sum.gradient.assign(pattern.size(), 0.0);
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    auto at = objectives_[c].evaluate(pattern.expand(x, c), stop);
    if (!at) return at.error();
    sum.value += at->value;
    sum.chi_squared += at->chi_squared;
    sum.regularization += at->regularization;
    pattern.gather(x, c, at->gradient, sum.gradient);
    at->gradient.clear();
    of_channels[c] = *std::move(at);
  }
  tried_.push_back({sum.value, std::move(of_channels)});
  return sum;
}

void SharedSolver::record(SharedProgress& progress) {
  const auto accepted = std::ranges::find(tried_, progress.state.at.value, &Tried::value);
  ENSURE(accepted != tried_.end());
  const auto at = std::move(accepted->channels);
  tried_.clear();
  const double seconds =
      seconds_before_ + std::chrono::duration<double>(clock_.now() - start_).count();
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    ChannelReport& report = progress.channels[c];
    report.solves = solves_before_[c] + objectives_[c].solves();
    report.seconds = seconds / kColorChannels;
    report.history.push_back({static_cast<int>(report.history.size()),
                              at[c].value,
                              at[c].chi_squared / static_cast<double>(report.data_count),
                              at[c].regularization,
                              report.solves});
  }
  hooks_.iterated(progress.channels[kReference]);
}

Result<SharedProgress> SharedSolver::begin(
    const SharedPattern& pattern,
    const std::array<HomogeneousFit, kColorChannels>& homogeneous,
    std::stop_token stop) {
  SharedProgress progress;
  progress.state.x = pattern.start();
  auto at = evaluate(pattern, progress.state.x, std::move(stop));
  if (!at) return at.error();
  progress.state.at = *std::move(at);
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    ChannelReport& report = progress.channels[c];
    report.homogeneous = homogeneous[c];
    report.homogeneous.chi_squared = tried_.back().channels[c].chi_squared;
    report.data_count = problems_[c].data_count;
    report.noise_per_datum = problems_[c].noise / static_cast<double>(report.data_count);
    report.target_per_datum =
        report.noise_per_datum + options_.discrepancy * (1.0 - report.noise_per_datum);
    solves_before_[c] = homogeneous[c].solves;
  }
  record(progress);
  return progress;
}

std::optional<StopReason> SharedSolver::reason_to_stop(const SharedProgress& progress) const {
  double target = 0.0;
  for (const ChannelReport& report : progress.channels)
    target += report.target_per_datum * static_cast<double>(report.data_count);
  if (progress.state.at.chi_squared <= target) return StopReason::kDiscrepancy;
  const std::size_t count = progress.channels[0].history.size();
  if (progress.channels[0].history.back().iteration >= options_.max_iterations)
    return StopReason::kIterationLimit;
  if (count <= kStallWindow) return std::nullopt;
  double before = 0.0;
  for (const ChannelReport& report : progress.channels)
    before += report.history[count - 1 - kStallWindow].objective;
  const double now = progress.state.at.value;
  if (before - now < options_.stalled * now) return StopReason::kStalled;
  return std::nullopt;
}

Result<SharedProgress> SharedSolver::run(
    const std::array<HomogeneousFit, kColorChannels>& homogeneous,
    std::optional<SharedProgress> from,
    std::stop_token stop) {
  start_ = clock_.now();
  const SharedPattern pattern(problems_[0].block, homogeneous);
  if (from) {
    for (std::size_t c = 0; c < kColorChannels; ++c) solves_before_[c] = from->channels[c].solves;
    seconds_before_ = from->channels[0].seconds * kColorChannels;
  } else {
    auto begun = begin(pattern, homogeneous, stop);
    if (!begun) return begun.error();
    from = *std::move(begun);
  }
  const Bounds box = pattern.bounds(options_);
  const ObjectiveFunction objective = [&](std::span<const double> x, std::stop_token token) {
    return evaluate(pattern, x, std::move(token));
  };
  for (;;) {
    auto reason = reason_to_stop(*from);
    if (!reason) {
      const auto outcome = lbfgs_step(from->state, box, {}, objective, stop);
      if (!outcome) return outcome.error();
      if (*outcome == StepOutcome::kNoDescent) reason = StopReason::kNoDescent;
    }
    if (reason) {
      for (ChannelReport& report : from->channels) report.stop_reason = *reason;
      return *std::move(from);
    }
    record(*from);
    if (from->channels[0].history.back().iteration % options_.checkpoint_every != 0) continue;
    if (auto saved = hooks_.checkpoint(*from); !saved) return saved.error();
    for (Objective& each : objectives_) each.start_afresh();
  }
}

}  // namespace opaline::reconstruct
