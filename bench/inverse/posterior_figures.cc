#include "bench/inverse/posterior_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "bench/figure.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/error_budget.h"
#include "reconstruct/grid_correction.h"
#include "reconstruct/posterior.h"

namespace opaline::bench {
namespace {

using reconstruct::PriorOptions;

struct Layer {
  double count = 0.0;
  double z = 0.0;
  double z2 = 0.0;
  double within = 0.0;
  double variance = 0.0;
  double prior = 0.0;  // variances
  double shape = 0.0;
  double error2 = 0.0;

  double z_mean() const { return z / count; }
  double z_sd() const { return std::sqrt(z2 / count - z_mean() * z_mean()); }
};

/// Layers from the seen face inwards.
std::size_t layer_of(const Dataset& d, std::size_t cell) {
  const Block& b = d.block;
  const std::array<std::size_t, 3> ijk{
      cell % b.nx, cell / b.nx % b.ny, cell / (static_cast<std::size_t>(b.nx) * b.ny)};
  const auto axis = static_cast<std::size_t>(axis_of(d.seen_face));
  return is_max(d.seen_face) ? b.cells()[axis] - 1 - ijk[axis] : ijk[axis];
}

void add(const Dataset& dataset,
         const std::vector<double>& error,
         const std::vector<double>& deviation,
         const PriorOptions& prior,
         std::vector<Layer>& layers) {
  for (std::size_t i = 0; i < error.size(); ++i) {
    Layer& layer = layers[layer_of(dataset, i)];
    const double z = error[i] / deviation[i];
    layer.count += 1.0;
    layer.z += z;
    layer.z2 += z * z;
    layer.within += std::abs(z) <= 2.0 ? 1.0 : 0.0;
    layer.variance += deviation[i] * deviation[i];
    layer.error2 += error[i] * error[i];
    layer.shape += prior.amplitude * prior.amplitude;
    layer.prior += prior.amplitude * prior.amplitude + prior.level * prior.level;
  }
}

/// About the posterior's own mean instead of the estimate.
struct Centred {
  std::vector<double> error;
  std::vector<double> deviation;
};
Centred centred(std::vector<double> error,
                std::vector<double> deviation,
                const std::vector<double>& shift) {
  for (std::size_t i = 0; i < shift.size(); ++i) {
    error[i] += shift[i];
    deviation[i] = std::sqrt(std::max(deviation[i] * deviation[i] - shift[i] * shift[i], 1e-12));
  }
  return {std::move(error), std::move(deviation)};
}

double extinction(const ChannelCoefficients& c, std::size_t i) {
  return c.absorption[i] + c.reduced_scattering[i];
}

void print(const Dataset& dataset, const std::string& name, const std::vector<Layer>& layers) {
  const double h = dataset.block.spacing()[static_cast<std::size_t>(axis_of(dataset.seen_face))];
  Layer all;
  Layer top;
  double least = layers.front().z_sd();
  double most = least;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const Layer& layer = layers[k];
    const std::string where =
        fmt::format("{}, {:.2f} mm deep", name, (static_cast<double>(k) + 0.5) * h);
    print_figure("posterior.z_sd", where, layer.z_sd(), "1");
    print_figure("posterior.z_mean", where, layer.z_mean(), "1");
    print_figure("posterior.deviation", where, std::sqrt(layer.variance / layer.count), "1");
    least = std::min(least, layer.z_sd());
    most = std::max(most, layer.z_sd());
    all.count += layer.count;
    all.within += layer.within;
    all.z += layer.z;
    all.error2 += layer.error2;
    if ((static_cast<double>(k) + 1.0) * h > 2.0 + 1e-9) continue;
    top.variance += layer.variance;
    top.prior += layer.prior;
    top.shape += layer.shape;
  }
  print_figure("posterior.z_sd_least", name, least, "1");
  print_figure("posterior.z_sd_most", name, most, "1");
  print_figure("posterior.bias", name, all.z_mean(), "1");
  print_figure("posterior.coverage_2sigma", name, all.within / all.count, "1");
  print_figure("posterior.rms_error", name, std::sqrt(all.error2 / all.count), "1");
  if (top.variance == 0.0) return;
  print_figure("posterior.tightening_top2mm", name, std::sqrt(top.prior / top.variance), "x");
  print_figure(
      "posterior.tightening_top2mm_of_shape", name, std::sqrt(top.shape / top.variance), "x");
}

/// The estimate moved to the posterior's mean; diffusion and absorption leave room for scattering.
ChannelCoefficients moved(const ChannelCoefficients& estimate, const LogCoefficients& shift) {
  ChannelCoefficients at = estimate;
  for (std::size_t i = 0; i < at.absorption.size(); ++i) {
    const double total = extinction(estimate, i) * std::exp(-shift.diffusion[i]);
    at.absorption[i] = std::min(at.absorption[i] * std::exp(shift.absorption[i]), 0.5 * total);
    at.reduced_scattering[i] = total - at.absorption[i];
  }
  return at;
}

void print_budget(const std::string& name, const reconstruct::ErrorBudget& budget) {
  print_figure("budget.measured", name, budget.measured, "1");
  print_figure("budget.sum", name, budget.sum(), "1");
  print_figure("budget.noise", name, budget.noise, "1");
  print_figure("budget.model", name, budget.model, "1");
  print_figure("budget.discretisation", name, budget.discretisation, "1");
  print_figure("budget.undetermined", name, budget.undetermined, "1");
}

}  // namespace

Result<Material> print_posterior(const std::string& name,
                                 const Dataset& dataset,
                                 const Material& truth,
                                 const reconstruct::InverseResult& result,
                                 const reconstruct::InverseOptions& options,
                                 reconstruct::diffusion::FluenceSolver& solver) {
  const SystemClock clock;
  double seconds = 0.0;
  long solves = 0;
  double held_out_variance = 0.0;
  const auto layer_count = static_cast<std::size_t>(
      dataset.block.cells()[static_cast<std::size_t>(axis_of(dataset.seen_face))]);
  std::vector<Layer> diffusion(layer_count);
  std::vector<Layer> absorption(layer_count);
  std::vector<Layer> diffusion_mean(layer_count);
  std::vector<Layer> absorption_mean(layer_count);
  Material mean = result.material;
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    const ChannelCoefficients& is = result.material.channels[c];
    const ChannelCoefficients& was = truth.channels[c];
    auto made =
        reconstruct::make_channel_problem(dataset, channel, options, reconstruct::Selection::kFit);
    if (!made) return made.error();
    reconstruct::ChannelProblem problem = *std::move(made);
    if (reconstruct::corrects_grid(options, dataset.block)) {
      const auto correction =
          reconstruct::grid_correction(problem, is, options.tolerance, solver, {});
      if (!correction) return correction.error();
      problem = reconstruct::corrected(std::move(problem), *correction);
    }
    const auto start = clock.now();
    const auto held_out = reconstruct::held_out_problem(dataset, channel, options);
    if (!held_out) return held_out.error();
    const reconstruct::PosteriorOptions posterior{.discrepancy = options.model_error};
    const auto known = reconstruct::posterior(problem, **held_out, solver, is, posterior, {});
    if (!known) return known.error();
    seconds += std::chrono::duration<double>(clock.now() - start).count();
    solves = std::max(solves, known->solves);
    held_out_variance += known->held_out_variance;
    std::vector<double> by_diffusion;
    std::vector<double> by_absorption;
    for (std::size_t i = 0; i < is.absorption.size(); ++i) {
      by_diffusion.push_back(std::log(extinction(was, i) / extinction(is, i)));
      by_absorption.push_back(std::log(is.absorption[i] / was.absorption[i]));
    }
    add(dataset, by_diffusion, known->deviation.diffusion, known->diffusion, diffusion);
    add(dataset, by_absorption, known->deviation.absorption, known->absorption, absorption);
    mean.channels[c] = moved(is, known->shift);
    const auto by_k = centred(by_diffusion, known->deviation.diffusion, known->shift.diffusion);
    const auto by_a = centred(by_absorption, known->deviation.absorption, known->shift.absorption);
    add(dataset, by_k.error, by_k.deviation, known->diffusion, diffusion_mean);
    add(dataset, by_a.error, by_a.deviation, known->absorption, absorption_mean);
    const std::string where = fmt::format("{}, {}", name, kChannelNames[c]);
    print_figure("posterior.amplitude_found", where, known->diffusion.amplitude, "1");
    print_figure("posterior.determined_diffusion", where, known->determined_diffusion, "1");
    print_figure("posterior.determined_absorption", where, known->determined_absorption, "1");
  }
  print(dataset, name + ", log kappa", diffusion);
  print(dataset, name + ", log sigma_a", absorption);
  print(dataset, name + ", log kappa, posterior mean", diffusion_mean);
  print(dataset, name + ", log sigma_a, posterior mean", absorption_mean);
  print_figure("posterior.solves", name, static_cast<double>(solves), "1");
  print_figure("posterior.seconds", name, seconds, "s");
  const auto grid =
      reconstruct::discretisation_error(dataset, result.material, options, solver, {});
  if (!grid) return grid.error();
  const auto budget =
      reconstruct::error_budget(dataset, result.predicted, *grid, held_out_variance);
  if (budget) print_budget(name, *budget);
  return mean;
}

}  // namespace opaline::bench
