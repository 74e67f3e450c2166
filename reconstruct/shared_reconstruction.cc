#include "reconstruct/shared_reconstruction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "reconstruct/model_choice.h"
#include "reconstruct/objective.h"
#include "reconstruct/shared_structure.h"

namespace opaline::reconstruct {
namespace {

using Problems = std::array<ChannelProblem, kColorChannels>;
using Fits = std::array<HomogeneousFit, kColorChannels>;
using Misfits = std::array<Misfit, kColorChannels>;

Result<Problems> problems_of(const Dataset& dataset,
                             const InverseOptions& options,
                             Selection selection) {
  Problems problems;
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    auto problem = make_channel_problem(dataset, static_cast<int>(c), options, selection);
    if (!problem) return problem.error();
    problems[c] = *std::move(problem);
  }
  return problems;
}

ChannelCoefficients homogeneous(const Block& block, const HomogeneousFit& fit) {
  return {std::vector<double>(block.cell_count(), fit.absorption),
          std::vector<double>(block.cell_count(), fit.reduced_scattering)};
}

class Shared {
 public:
  Shared(const Dataset& dataset,
         const InverseOptions& options,
         diffusion::FluenceSolver& solver,
         const Clock& clock,
         const SharedHooks& hooks,
         std::stop_token stop)
      : dataset_(dataset),
        options_(options),
        solver_(solver),
        clock_(clock),
        hooks_(hooks),
        stop_(std::move(stop)) {}

  Result<std::optional<FinishedChannels>> run(std::optional<SharedProgress> from) {
    auto fit = problems_of(dataset_, options_, Selection::kFit);
    if (!fit) return fit.error();
    auto held_out = problems_of(dataset_, options_, Selection::kHeldOut);
    if (!held_out) return held_out.error();
    fit_ = *std::move(fit);
    held_out_ = *std::move(held_out);
    auto simple = simple_fits(from);
    if (!simple) return simple.error();
    if (auto judged = judge_simple(*simple); !judged) return judged.error();
    if (!from && is_automatic() && std::ranges::all_of(simple_, is_explained)) return nothing();
    const auto start = clock_.now();
    SharedSolver joint(fit_, options_, solver_, clock_, {hooks_.iterated, hooks_.checkpoint});
    auto found = joint.run(*simple, std::move(from), stop_);
    if (!found) return found.error();
    seconds_ = std::chrono::duration<double>(clock_.now() - start).count();
    return finish(SharedPattern(dataset_.block, *simple), *std::move(found));
  }

 private:
  static std::optional<FinishedChannels> nothing() { return std::nullopt; }
  bool can_validate() const { return held_out_[0].data_count > 0; }
  bool is_automatic() const { return options_.model == Model::kAuto && can_validate(); }

  Result<Fits> simple_fits(const std::optional<SharedProgress>& from) {
    Fits fits;
    for (std::size_t c = 0; c < kColorChannels; ++c) {
      if (from) {
        fits[c] = from->channels[c].homogeneous;
        continue;
      }
      hooks_.iterated({});
      auto fit = fit_homogeneous(fit_[c], options_, solver_, stop_);
      if (!fit) return fit.error().in("homogeneous fit");
      fits[c] = *fit;
    }
    return fits;
  }

  Result<Misfit> predict(std::size_t channel, const ChannelCoefficients& coefficients) {
    if (!can_validate()) return Misfit{};
    Objective objective(held_out_[channel], solver_, {options_.tolerance, 0.0});
    auto radiance = objective.predict(coefficients, stop_);
    if (!radiance) return radiance.error();
    return misfit(held_out_[channel], *std::move(radiance));
  }

  Result<void> judge_simple(const Fits& fits) {
    for (std::size_t c = 0; c < kColorChannels; ++c) {
      auto misfit = predict(c, homogeneous(dataset_.block, fits[c]));
      if (!misfit) return misfit.error();
      simple_[c] = *std::move(misfit);
    }
    return ok();
  }

  Result<std::optional<FinishedChannels>> finish(const SharedPattern& pattern,
                                                 SharedProgress found) {
    FinishedChannels finished;
    double gained = 0.0;
    double variance = 0.0;
    for (std::size_t c = 0; c < kColorChannels; ++c) {
      finished[c] = {to_coefficients(pattern.expand(found.state.x, c)),
                     std::move(found.channels[c])};
      const auto misfit = predict(c, finished[c].coefficients);
      if (!misfit) return misfit.error();
      const Gain of_channel = gain(held_out_[c], simple_[c], *misfit);
      gained += of_channel.per_datum;
      variance += of_channel.standard_error * of_channel.standard_error;
      tell(c, *misfit, of_channel, pattern.size(), finished[c].report);
    }
    if (is_automatic() && gained <= std::sqrt(variance)) return nothing();
    return std::optional(std::move(finished));
  }

  void tell(std::size_t channel,
            const Misfit& misfit,
            const Gain& gained,
            std::size_t parameters,
            ChannelReport& report) const {
    const ChannelProblem& held_out = held_out_[channel];
    ModelReport simple;
    simple.name = "homogeneous";
    simple.parameters = 2;
    simple.fitted = report.history.front().chi_squared_per_datum;
    simple.held_out = simple_[channel].per_datum();
    simple.standard_error = simple_[channel].standard_error();
    simple.solves = report.history.front().solves;
    simple.taken = true;
    simple.why = "the simplest model";
    ModelReport shared;
    shared.name = "heterogeneous, one structure of all channels";
    shared.parameters = parameters;  // of all channels together
    shared.fitted = report.history.back().chi_squared_per_datum;
    shared.held_out = misfit.per_datum();
    shared.standard_error = misfit.standard_error();
    shared.gain = gained.per_datum;
    shared.gain_error = gained.standard_error;
    shared.solves = report.solves - simple.solves;
    shared.seconds = seconds_ / kColorChannels;
    shared.taken = true;
    shared.why = is_automatic()
                     ? fmt::format(
                           "the held-out error changes by {:.3g} ± {:.2g}; taken for all "
                           "channels together",
                           -gained.per_datum,
                           gained.standard_error)
                     : "asked for";
    report.ladder = {std::move(simple), std::move(shared)};
    report.model = report.ladder.back().name;
    report.model_reason = "one structure was asked for";
    if (held_out.data_count > 0)
      report.held_out_noise = held_out.noise / static_cast<double>(held_out.data_count);
  }

  const Dataset& dataset_;
  const InverseOptions& options_;
  diffusion::FluenceSolver& solver_;
  const Clock& clock_;
  const SharedHooks& hooks_;
  std::stop_token stop_;
  Problems fit_;
  Problems held_out_;
  Misfits simple_;  // of the homogeneous fits, held-out data
  double seconds_ = 0.0;
};

}  // namespace

bool asks_for_shared_structure(const InverseOptions& options) {
  return options.structure == Structure::kShared && options.max_iterations > 0 &&
         (options.model == Model::kAuto || options.model == Model::kHeterogeneous);
}

Result<std::optional<FinishedChannels>> reconstruct_shared(const Dataset& dataset,
                                                           const InverseOptions& options,
                                                           diffusion::FluenceSolver& solver,
                                                           const Clock& clock,
                                                           std::optional<SharedProgress> from,
                                                           const SharedHooks& hooks,
                                                           std::stop_token stop) {
  return Shared(dataset, options, solver, clock, hooks, std::move(stop)).run(std::move(from));
}

}  // namespace opaline::reconstruct
