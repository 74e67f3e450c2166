#include "reconstruct/inverse_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/log.h"
#include "reconstruct/direct_light.h"
#include "reconstruct/model_ladder.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "reconstruct/shared_reconstruction.h"

namespace opaline::reconstruct {
namespace {

constexpr std::chrono::seconds kBetweenFacts{
    10};  // a checkpoint is saved more often than is worth a durable line

std::string channel_name(std::size_t channel) { return kChannelNames.at(channel); }

class Reconstruction {
 public:
  Reconstruction(const Dataset& dataset,
                 const InverseOptions& options,
                 const InverseContext& context)
      : dataset_(dataset), options_(options), context_(context), start_(context.clock.now()) {}

  Result<InverseResult> run(std::stop_token stop) {
    if (context_.checkpoints != nullptr) checkpoint_ = context_.checkpoints->load();
    result_.material.block = dataset_.block;
    result_.material.ior = dataset_.ior;
    result_.predicted = empty_pictures(dataset_);
    if (auto shared = solve_shared(stop); !shared) return shared.error().in("shared structure");
    for (std::size_t channel = 0; channel < kColorChannels; ++channel) {
      auto done = run_channel(channel, stop);
      if (!done) return done.error().in(fmt::format("{} channel", channel_name(channel)));
    }
    result_.fitted = relighting_error(dataset_, result_.predicted, false);
    result_.held_out = relighting_error(dataset_, result_.predicted, true);
    result_.solver = context_.solver.description();  // the one that did the last of it
    result_.seconds = seconds();
    return std::move(result_);
  }

 private:
  double seconds() const {
    return std::chrono::duration<double>(context_.clock.now() - start_).count();
  }

  // Finishes all channels at once, where one structure is asked for and found; does nothing where they go on each by
  // itself, as they do when a checkpoint has them doing so.
  Result<void> solve_shared(std::stop_token stop) {
    const bool decided = checkpoint_.finished[0].has_value() || checkpoint_.current.has_value();
    if (!asks_for_shared_structure(options_) || decided) return ok();
    auto found = reconstruct_shared(
        dataset_,
        options_,
        context_.solver,
        context_.clock,
        std::exchange(checkpoint_.shared, std::nullopt),
        {[this](const ChannelReport& report) { report_progress(0, report, 0, 1); },
         [this](const SharedProgress& progress) { return save(progress); }},
        std::move(stop));
    if (!found) return found.error();
    if (!*found) return ok();
    for (std::size_t c = 0; c < kColorChannels; ++c)
      checkpoint_.finished[c] = std::move((**found)[c]);
    if (auto saved = save(); !saved) return saved;
    for (std::size_t c = 0; c < kColorChannels; ++c) {
      if (auto said = say_reconstructed(c); !said) return said;
    }
    return ok();
  }

  Result<void> run_channel(std::size_t channel, std::stop_token stop) {
    if (!checkpoint_.finished[channel]) {
      auto solved = solve_channel(channel, stop);
      if (!solved) return solved;
    }
    const Checkpoint::Finished& finished = *checkpoint_.finished[channel];
    result_.material.channels[channel] = finished.coefficients;
    result_.channels[channel] = finished.report;
    return predict_channel(dataset_,
                           finished.coefficients,
                           static_cast<int>(channel),
                           options_,
                           context_.solver,
                           result_.predicted,
                           std::move(stop));
  }

  Result<void> solve_channel(std::size_t channel, std::stop_token stop) {
    auto models =
        ModelLadder::create(dataset_,
                            static_cast<int>(channel),
                            options_,
                            context_.solver,
                            context_.clock,
                            {[&](const ChannelReport& report, std::size_t done, std::size_t rungs) {
                               report_progress(channel, report, done, rungs);
                             },
                             [&](const LadderProgress& progress) { return save(progress); }},
                            context_.engine);
    if (!models) return models.error();
    auto progress = models->run(std::exchange(checkpoint_.current, std::nullopt), stop);
    if (!progress) return progress.error();
    checkpoint_.finished[channel] = {to_coefficients(progress->best), std::move(progress->report)};
    if (auto saved = save(); !saved) return saved;
    return say_reconstructed(channel);
  }

  Result<void> say_reconstructed(std::size_t channel) {
    const ChannelReport& report = checkpoint_.finished[channel]->report;
    log::info("{} channel: {}, {} iterations, chi^2/N {:.2f}, {}, {:.1f} s",
              channel_name(channel),
              report.model,
              report.history.back().iteration,
              report.history.back().chi_squared_per_datum,
              to_string(report.stop_reason),
              report.seconds);
    return context_.events.fact(
        "channel.reconstructed",
        {{"channel", channel_name(channel)},
         {"model", report.model},
         {"iterations", report.history.back().iteration},
         {"chi_squared_per_datum", report.history.back().chi_squared_per_datum},
         {"stop_reason", to_string(report.stop_reason)},
         {"seconds", report.seconds}});
  }

  Result<void> save(const SharedProgress& progress) {
    if (context_.checkpoints == nullptr) return ok();
    checkpoint_.shared = progress;
    auto saved = context_.checkpoints->save(checkpoint_);
    checkpoint_.shared.reset();
    return saved;
  }

  Result<void> save(const LadderProgress& progress) {
    if (context_.checkpoints == nullptr) return ok();
    checkpoint_.current = progress;
    auto saved = context_.checkpoints->save(checkpoint_);
    checkpoint_.current.reset();
    if (!saved || context_.clock.now() - last_said_ < kBetweenFacts) return saved;
    last_said_ = context_.clock.now();
    const auto& history =
        progress.current ? progress.current->report.history : progress.report.history;
    return context_.events.fact("checkpoint.saved", {{"iteration", history.back().iteration}});
  }

  Result<void> save() const {
    return context_.checkpoints == nullptr ? ok() : context_.checkpoints->save(checkpoint_);
  }

  // How far a model's fit is: chi^2 falls about exponentially to its target, unless the limit of
  // iterations comes first.
  double rung_fraction(const ChannelReport& report) const {
    if (report.history.empty()) return 0.0;
    const IterationRecord& now = report.history.back();
    const double target = std::max(report.target_per_datum, 1e-3);
    const double whole = std::log(report.history.front().chi_squared_per_datum / target);
    const double left = std::log(now.chi_squared_per_datum / target);
    const double fallen = whole > 0.0 ? 1.0 - left / whole : 1.0;
    const double spent = static_cast<double>(now.iteration) / std::max(options_.max_iterations, 1);
    return std::clamp(std::max(fallen, spent), 0.05, 0.99);
  }

  // Of a channel: the rungs before this one, and this one's own. A ladder may end early.
  static double share(double of_rung, std::size_t done, std::size_t rungs) {
    return rungs > 0 ? (static_cast<double>(std::min(done, rungs - 1)) + of_rung) /
                           static_cast<double>(rungs)
                     : 0.0;
  }

  void report_progress(std::size_t channel,
                       const ChannelReport& report,
                       std::size_t done,
                       std::size_t rungs) {
    Progress progress;
    progress.step = report.history.empty() ? "homogeneous fit" : "reconstruction";
    progress.fraction =
        (static_cast<double>(channel) + share(rung_fraction(report), done, rungs)) / kColorChannels;
    if (!first_fraction_) first_fraction_ = progress.fraction;  // done by those before us
    if (const double gone = progress.fraction - *first_fraction_; gone > 0.0)
      progress.seconds_left = seconds() * (1.0 - progress.fraction) / gone;
    progress.detail["channel"] = channel_name(channel);
    if (!report.history.empty()) {
      const IterationRecord& now = report.history.back();
      progress.detail["iteration"] = now.iteration;
      progress.detail["objective"] = now.objective;
      progress.detail["chi_squared_per_datum"] = now.chi_squared_per_datum;
    }
    context_.events.progress(progress);
  }

  const Dataset& dataset_;
  const InverseOptions& options_;
  const InverseContext& context_;
  std::chrono::nanoseconds start_;
  std::chrono::nanoseconds last_said_ = start_;  // that a checkpoint was saved
  std::optional<double> first_fraction_;
  Checkpoint checkpoint_;
  InverseResult result_;
};

}  // namespace

Result<InverseResult> reconstruct_material(const Dataset& dataset,
                                           const InverseOptions& options,
                                           const InverseContext& context,
                                           std::stop_token stop) {
  if (auto valid = validate(options); !valid) return valid.error();
  const auto margin = direct_light_margin(dataset, options, context.solver, stop);
  if (!margin) return margin.error().in("direct light");
  const Dataset masked = without_direct_light(dataset, *margin);
  auto result = Reconstruction(masked, options, context).run(std::move(stop));
  if (!result && result.error().code == ErrorCode::kInvalidArgument && *margin > 0.0) {
    return result.error().in(fmt::format("{:.1f} mm around lit cells left out", *margin));
  }
  if (result) result->direct_light_margin_mm = *margin;
  return result;
}

}  // namespace opaline::reconstruct
