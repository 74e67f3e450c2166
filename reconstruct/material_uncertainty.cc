#include "reconstruct/material_uncertainty.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "reconstruct/channel_problem.h"
#include "reconstruct/direct_light.h"
#include "reconstruct/grid_correction.h"

namespace opaline::reconstruct {
namespace {

using Json = nlohmann::ordered_json;

std::vector<double> rms_by_depth(const Block& b, Face seen, const std::vector<double>& deviation) {
  const auto axis = static_cast<std::size_t>(axis_of(seen));
  const auto layers = static_cast<std::size_t>(b.cells()[axis]);
  std::vector<double> sum(layers, 0.0);
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i) {
        const auto at = static_cast<std::size_t>(std::array{i, j, k}[axis]);
        const double d = deviation[b.index(i, j, k)];
        sum[is_max(seen) ? layers - 1 - at : at] += d * d;
      }
  const double cells = static_cast<double>(b.cell_count()) / static_cast<double>(layers);
  for (double& s : sum) s = std::sqrt(s / cells);
  return sum;
}

double root_mean_square(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum / static_cast<double>(v.size()));
}

double deviation_of(const PriorOptions& prior) { return std::hypot(prior.level, prior.amplitude); }

// Of log sigma_s' where log kappa and log sigma_a vary independently.
double scattering_deviation(const ChannelCoefficients& c, double diffusion, double absorption) {
  std::vector<double> cells;
  for (std::size_t i = 0; i < c.absorption.size(); ++i) {
    const double share = c.absorption[i] / c.reduced_scattering[i];
    cells.push_back(std::hypot((1.0 + share) * diffusion, share * absorption));
  }
  return root_mean_square(cells);
}

class Uncertainties {
 public:
  Uncertainties(const Dataset& dataset,
                const InverseOptions& options,
                const InverseResult& found,
                const PosteriorOptions& posterior,
                const UncertaintyContext& context)
      : dataset_(without_direct_light(dataset, found.direct_light_margin_mm)),
        options_(options),
        found_(found),
        material_(found.material),
        posterior_(posterior),
        context_(context),
        start_(context.clock.now()) {
    posterior_.discrepancy = options.model_error;
  }

  Result<UncertaintyResult> run(const std::stop_token& stop) {
    result_.length_mm = posterior_.length_mm;
    result_.layer_mm =
        dataset_.block.spacing()[static_cast<std::size_t>(axis_of(dataset_.seen_face))];
    for (std::size_t c = 0; c < kColorChannels; ++c) {
      report_progress(c);
      auto done = add_channel(c, stop);
      if (!done) return done.error().in(fmt::format("{} channel", kChannelNames[c]));
    }
    if (has_held_out()) {
      if (auto added = add_budget(stop); !added) return added.error().in("error budget");
    }
    report_progress(kColorChannels);
    result_.seconds = seconds();
    return std::move(result_);
  }

 private:
  Result<void> add_channel(std::size_t c, const std::stop_token& stop) {
    const double begun = seconds();
    auto made = make_channel_problem(dataset_, static_cast<int>(c), options_, Selection::kFit);
    if (!made) return made.error();
    ChannelProblem problem = *std::move(made);
    const ChannelCoefficients& estimate = material_.channels[c];
    if (corrects_grid(options_, dataset_.block)) {
      const auto correction =
          grid_correction(problem, estimate, options_.tolerance, context_.solver, stop);
      if (!correction) return correction.error();
      problem = corrected(std::move(problem), *correction);
    }
    const auto held_out = held_out_problem(dataset_, static_cast<int>(c), options_);
    if (!held_out) return held_out.error();
    auto found = held_out->has_value()
                     ? posterior(problem, **held_out, context_.solver, estimate, posterior_, stop)
                     : posterior(problem, context_.solver, estimate, posterior_, stop);
    if (!found) return found.error();
    held_out_variance_ += found->held_out_variance;
    result_.channels[c] = report(*found, estimate);
    result_.channels[c].seconds = seconds() - begun;
    result_.material[c] = {std::move(found->deviation), std::move(found->shift)};
    return ok();
  }

  bool has_held_out() const {
    return std::ranges::any_of(dataset_.illuminations,
                               [](const Illumination& i) { return i.held_out; });
  }

  Result<void> add_budget(const std::stop_token& stop) {
    const auto grid = discretisation_error(dataset_, material_, options_, context_.solver, stop);
    if (!grid) return grid.error();
    result_.budget = error_budget(dataset_, found_.predicted, *grid, held_out_variance_);
    return ok();
  }

  ChannelUncertaintyReport report(const ChannelPosterior& p, const ChannelCoefficients& c) const {
    const auto layers = [&](const std::vector<double>& deviation) {
      return rms_by_depth(dataset_.block, dataset_.seen_face, deviation);
    };
    const double diffusion = deviation_of(p.diffusion);
    const double absorption = deviation_of(p.absorption);
    ChannelUncertaintyReport r;
    r.absorption = {absorption, p.absorption.amplitude, layers(p.deviation.absorption)};
    r.diffusion = {diffusion, p.diffusion.amplitude, layers(p.deviation.diffusion)};
    r.reduced_scattering = {scattering_deviation(c, diffusion, absorption),
                            scattering_deviation(c, p.diffusion.amplitude, p.absorption.amplitude),
                            layers(p.deviation.reduced_scattering)};
    r.determined_diffusion = p.determined_diffusion;
    r.determined_absorption = p.determined_absorption;
    r.solves = p.solves;
    return r;
  }

  double seconds() const {
    return std::chrono::duration<double>(context_.clock.now() - start_).count();
  }

  void report_progress(std::size_t done) const {
    Progress progress;
    progress.step = "uncertainty";
    progress.fraction = static_cast<double>(done) / kColorChannels;
    if (done > 0) progress.seconds_left = seconds() * (1.0 / progress.fraction - 1.0);
    if (done < kColorChannels) progress.detail["channel"] = kChannelNames[done];
    context_.events.progress(progress);
  }

  Dataset dataset_;
  const InverseOptions& options_;
  const InverseResult& found_;
  const Material& material_;
  PosteriorOptions posterior_;
  const UncertaintyContext& context_;
  std::chrono::nanoseconds start_;
  double held_out_variance_ = 0.0;
  UncertaintyResult result_;
};

Json to_json(const DeviationByDepth& d) {
  return {{"prior", d.prior}, {"amplitude", d.amplitude}, {"layers", d.layers}};
}

Json to_json(const ErrorBudget& b) {
  return {{"measured", b.measured},
          {"noise", b.noise},
          {"calibration", b.calibration},
          {"model", b.model},
          {"discretisation", b.discretisation},
          {"undetermined", b.undetermined},
          {"sum", b.sum()}};
}

}  // namespace

Result<std::optional<UncertaintyResult>> material_uncertainty(const Dataset& dataset,
                                                              const InverseOptions& options,
                                                              const InverseResult& found,
                                                              const PosteriorOptions& posterior,
                                                              const UncertaintyContext& context,
                                                              std::stop_token stop) {
  const auto is_homogeneous = [](const ChannelReport& channel) {
    return channel.model == to_string(Model::kHomogeneous);
  };
  if (std::ranges::all_of(found.channels, is_homogeneous))
    return std::optional<UncertaintyResult>();
  auto result = Uncertainties(dataset, options, found, posterior, context).run(stop);
  if (!result) return result.error();
  return std::optional(*std::move(result));
}

Json to_json(const UncertaintyResult& uncertainty) {
  Json channels = Json::array();
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const ChannelUncertaintyReport& r = uncertainty.channels[c];
    channels.push_back({{"channel", kChannelNames[c]},
                        {"determined_diffusion", r.determined_diffusion},
                        {"determined_absorption", r.determined_absorption},
                        {"solves", r.solves},
                        {"seconds", r.seconds},
                        {"absorption", to_json(r.absorption)},
                        {"reduced_scattering", to_json(r.reduced_scattering)},
                        {"diffusion", to_json(r.diffusion)}});
  }
  Json json{{"length_mm", uncertainty.length_mm},
            {"layer_mm", uncertainty.layer_mm},
            {"seconds", uncertainty.seconds},
            {"channels", std::move(channels)}};
  if (uncertainty.budget) json["error_budget"] = to_json(*uncertainty.budget);
  return json;
}

}  // namespace opaline::reconstruct
