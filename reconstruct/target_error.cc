#include "reconstruct/target_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"

namespace opaline::reconstruct {
namespace {

constexpr int kManyIterations = 1000;

int fewer(int given, int n) { return given == 0 ? n : std::min(given, n); }

std::string percent(double share) { return fmt::format("{:.2g} %", 100.0 * share); }

/// Tells which rung it is that makes progress.
class RungSink : public EventSink {
 public:
  RungSink(EventSink& to, std::size_t rung, std::size_t rungs)
      : to_(to), rung_(rung), rungs_(rungs) {}
  void progress(const Progress& progress) override {
    Progress told = progress;
    told.fraction = (static_cast<double>(rung_) + progress.fraction) / static_cast<double>(rungs_);
    told.seconds_left.reset();  // the dear ones come last, if they come
    told.detail["rung"] = rung_ + 1;
    told.detail["rungs"] = rungs_;
    to_.progress(told);
  }
  Result<void> fact(std::string_view type, const nlohmann::json& data) override {
    return to_.fact(type, data);
  }

 private:
  EventSink& to_;
  std::size_t rung_;
  std::size_t rungs_;
};

std::string measured(const RungReport& r) {
  return fmt::format("{}: relighting error {}, noise {}, {:.1f} s",
                     r.name,
                     percent(r.held_out.error),
                     percent(r.held_out.noise_floor),
                     r.seconds);
}

// What is left once noise is taken off is the model's and the grid's.
std::string explanation(const TargetReport& report) {
  const RelightingError& best = report.rungs[report.chosen].held_out;
  if (report.reached)
    return fmt::format("reached {} of the {} asked for, with {}",
                       percent(best.error),
                       percent(report.target),
                       report.rungs[report.chosen].name);
  if (best.noise_floor >= report.target)
    return fmt::format(
        "reached {} of the {} asked for: the noise of the held-out pictures alone makes {}; longer "
        "exposures lower it",
        percent(best.error),
        percent(report.target),
        percent(best.noise_floor));
  const double own =
      std::sqrt(std::max(0.0, best.error * best.error - best.noise_floor * best.noise_floor));
  return fmt::format(
      "reached {} of the {} asked for, and no setting does better: noise makes {} of it; the {} "
      "beyond are the model's "
      "own, the grid's, and what the captured lights leave open",
      percent(best.error),
      percent(report.target),
      percent(best.noise_floor),
      percent(own));
}

class Climb {
 public:
  Climb(const Dataset& dataset, double target, const ReducedContext& context)
      : dataset_(dataset), context_(context) {
    report_.target = target;
  }

  Result<TargetResult> run(const std::vector<Rung>& rungs, std::stop_token stop) {
    for (std::size_t r = 0; r < rungs.size() && !report_.reached; ++r) {
      auto tried = attempt(rungs[r], r, rungs.size(), stop);
      if (!tried) return tried.error().in(rungs[r].name);
    }
    report_.message = explanation(report_);
    return TargetResult{*std::move(best_), std::move(report_)};
  }

 private:
  Result<void> attempt(const Rung& rung, std::size_t r, std::size_t count, std::stop_token stop) {
    RungSink events(context_.events, r, count);
    auto result = reconstruct_reduced(dataset_,
                                      rung.reduction,
                                      rung.options,
                                      {context_.solver,
                                       events,
                                       context_.clock,
                                       context_.files,
                                       context_.checkpoints / fmt::format("rung_{}", r + 1),
                                       context_.engine},
                                      std::move(stop));
    if (!result) return result.error();
    report_.rungs.push_back({rung.name, result->seconds, result->held_out});
    report_.reached = result->held_out.error <= report_.target;
    if (!best_ || report_.reached || result->held_out.error < best_->held_out.error) {
      best_ = *std::move(result);
      report_.chosen = r;
    }
    const RungReport& now = report_.rungs.back();
    return context_.events.fact("accuracy.measured",
                                {{"rung", now.name},
                                 {"relighting_error", now.held_out.error},
                                 {"noise_floor", now.held_out.noise_floor},
                                 {"target", report_.target},
                                 {"seconds", now.seconds},
                                 {"message", measured(now)}});
  }

  const Dataset& dataset_;
  const ReducedContext& context_;
  TargetReport report_;
  std::optional<InverseResult> best_;
};

double noise_floor(const Dataset& dataset) {
  return relighting_error(dataset, empty_pictures(dataset), true).noise_floor;
}

}  // namespace

std::vector<Rung> rungs(const Reduction& given, const InverseOptions& options) {
  const auto step = [&](double s) { return std::max(given.grid_step, s); };
  Rung homogeneous{"a homogeneous sample", {step(4.0), fewer(given.regions, 2)}, options};
  homogeneous.options.max_iterations = 0;
  const Rung quarter{
      "a quarter of the grid, 2 x 2 regions", {step(4.0), fewer(given.regions, 2)}, options};
  const Rung half{"half of the grid", {step(2.0), given.regions}, options};
  const Rung as_given{"the settings as given", given, options};
  Rung converged{"the same, run on to convergence", given, options};
  converged.options.max_iterations = std::max(options.max_iterations, kManyIterations);
  converged.options.discrepancy = 0.0;
  converged.options.stalled = options.stalled / 5.0;
  return {homogeneous, quarter, half, as_given, converged};
}

Result<TargetResult> reconstruct_to_target(const Dataset& dataset,
                                           double target,
                                           const Reduction& given,
                                           const InverseOptions& options,
                                           const ReducedContext& context,
                                           std::stop_token stop) {
  if (!(target > 0.0 && target < 1.0))
    return invalid_argument(fmt::format("target_error = {}; expected > 0 and < 1", target));
  const double floor = noise_floor(dataset);
  if (!(floor > 0.0))
    return invalid_argument(
        "a target_error needs lights that were kept from the fit, and there are none");
  std::vector<Rung> all = rungs(given, options);
  if (floor >= target) all = {all[all.size() - 2]};
  return Climb(dataset, target, context).run(all, std::move(stop));
}

}  // namespace opaline::reconstruct
