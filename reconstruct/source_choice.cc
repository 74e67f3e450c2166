#include "reconstruct/source_choice.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/log.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/direct_light.h"
#include "reconstruct/homogeneous_fit.h"
#include "reconstruct/objective.h"

namespace opaline::reconstruct {
namespace {

constexpr int kGreen = 1;

struct Judged {
  ChannelProblem problem;
  Misfit misfit;
};

Result<Judged> judge(const Dataset& dataset,
                     const InverseOptions& options,
                     diffusion::FluenceSolver& solver,
                     const std::stop_token& stop) {
  const auto fitted = make_channel_problem(dataset, kGreen, options, Selection::kFit);
  if (!fitted) return fitted.error();
  const auto fit = fit_homogeneous(*fitted, options, solver, stop);
  if (!fit) return fit.error();
  const bool held_out = std::ranges::any_of(dataset.illuminations, &Illumination::held_out);
  auto problem = make_channel_problem(
      dataset, kGreen, options, held_out ? Selection::kHeldOut : Selection::kAll);
  if (!problem) return problem.error();
  const std::size_t cells = dataset.block.cell_count();
  Objective objective(*problem, solver, {.tolerance = options.tolerance});
  auto radiance = objective.predict({std::vector<double>(cells, fit->absorption),
                                     std::vector<double>(cells, fit->reduced_scattering)},
                                    stop);
  if (!radiance) return radiance.error();
  Misfit misfit = reconstruct::misfit(*problem, *std::move(radiance));
  return Judged{*std::move(problem), std::move(misfit)};
}

std::string explain(const SourceChoice& choice) {
  const bool collimated = choice.model == diffusion::SourceModel::kCollimated;
  return fmt::format(
      "as a homogeneous sample, chi^2 per judging datum falls from {:.3g} with a surface source by "
      "{:.2g} +- {:.2g} with a "
      "collimated one, which is {}",
      choice.surface,
      choice.gain.per_datum,
      choice.gain.standard_error,
      collimated ? "more than its standard error" : "no gain beyond its standard error");
}

}  // namespace

Result<SourceChoice> choose_source(const Dataset& dataset,
                                   const InverseOptions& options,
                                   diffusion::FluenceSolver& solver,
                                   std::stop_token stop) {
  InverseOptions sketch = options;
  sketch.max_iterations = std::max(1, options.max_iterations);  // few pictures tell enough
  sketch.source = diffusion::SourceModel::kCollimated;
  const auto margin = direct_light_margin(dataset, sketch, solver, stop);
  if (!margin) return margin.error().in("source");
  const Dataset masked = without_direct_light(dataset, *margin);
  const auto collimated = judge(masked, sketch, solver, stop);
  if (!collimated) return collimated.error().in("collimated source");
  sketch.source = diffusion::SourceModel::kSurface;
  const auto surface = judge(masked, sketch, solver, stop);
  if (!surface) return surface.error().in("surface source");
  SourceChoice choice;
  choice.surface = surface->misfit.per_datum();
  choice.collimated = collimated->misfit.per_datum();
  choice.gain = gain(surface->problem, surface->misfit, collimated->misfit);
  if (choice.gain.is_significant()) choice.model = diffusion::SourceModel::kCollimated;
  choice.why = explain(choice);
  log::info("light enters: {}: {}", to_string(choice.model), choice.why);
  return choice;
}

}  // namespace opaline::reconstruct
