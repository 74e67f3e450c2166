#include "reconstruct/surface_reflectance.h"

#include <utility>

#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/lit_surface.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/prediction.h"

namespace opaline::reconstruct {
namespace {

/// Adds what shines on lit cells beyond diffusion.
Result<void> add_lit_surface(const Dataset& lit,
                             const Material& material,
                             int channel,
                             const InverseOptions& options,
                             Image<float>& radiance) {
  if (options.source != diffusion::SourceModel::kCollimated) return ok();
  const auto problem = make_channel_problem(lit, channel, options, Selection::kAll);
  if (!problem) return problem.error();
  if (problem->rays.empty()) return ok();
  const auto more = diffusion::lit_surface(
      diffusion::make_medium(problem->block, material.channels[channel], problem->boundary),
      problem->boundary,
      lit.ior,
      lit.seen_face,
      problem->rays,
      problem->illuminations.front().irradiance);
  for (std::size_t x = 0; x < more.size(); ++x)
    radiance.samples()[kColorChannels * x + channel] +=
        static_cast<float>(problem->camera[x].source_gain * more[x]);
  return ok();
}

SurfaceReflectance remainder(const Dataset& dataset, const Image<float>& explained) {
  const Illumination& uniform = *dataset.uniform;
  const Image<float> none(explained.width(), explained.height(), kColorChannels);
  SurfaceReflectance surface{dataset.block, dataset.seen_face, none, none, uniform.mask};
  for (std::size_t s = 0; s < explained.samples().size(); ++s)
    if (!(uniform.irradiance.samples()[s] > 0.0F)) surface.mask.samples()[s / kColorChannels] = 0;
  for (std::size_t s = 0; s < explained.samples().size(); ++s) {
    if (surface.mask.samples()[s / kColorChannels] == 0) continue;
    const float e = uniform.irradiance.samples()[s];
    surface.reflectance.samples()[s] = (uniform.radiance.samples()[s] - explained.samples()[s]) / e;
    surface.variance.samples()[s] = uniform.radiance_variance.samples()[s] / (e * e);
  }
  return surface;
}

}  // namespace

Result<std::optional<SurfaceReflectance>> surface_reflectance(const Dataset& dataset,
                                                              const Material& material,
                                                              const InverseOptions& options,
                                                              diffusion::FluenceSolver& solver,
                                                              std::stop_token stop) {
  if (!dataset.uniform) return std::optional<SurfaceReflectance>();
  if (!(material.block == dataset.block))
    return invalid_argument("material and dataset have different blocks");
  if (dataset.lit_face != dataset.seen_face)
    return invalid_argument("the lit face, whose surface reflects, is not the one that is seen");
  Dataset lit = dataset;
  lit.illuminations = {*dataset.uniform};
  auto explained = predict(lit, material, options, solver, std::move(stop));
  if (!explained) return explained.error().in("surface reflectance");
  for (int c = 0; c < kColorChannels; ++c) {
    const auto added = add_lit_surface(lit, material, c, options, explained->front());
    if (!added) return added.error().in("surface reflectance");
  }
  return std::optional(remainder(dataset, explained->front()));
}

}  // namespace opaline::reconstruct
