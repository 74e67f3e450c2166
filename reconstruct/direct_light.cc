#include "reconstruct/direct_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/direct_light.h"
#include "base/log.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/homogeneous_fit.h"

namespace opaline::reconstruct {

Result<double> direct_light_margin(const Dataset& dataset,
                                   const InverseOptions& options,
                                   diffusion::FluenceSolver& solver,
                                   std::stop_token stop) {
  if (dataset.lit_face != dataset.seen_face) return 0.0;
  InverseOptions sketch = options;
  sketch.max_iterations = std::max(1, options.max_iterations);  // few pictures tell enough
  double least = std::numeric_limits<double>::infinity();
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const auto problem = make_channel_problem(dataset, channel, sketch, Selection::kFit);
    if (!problem) return problem.error();
    const auto fit = fit_homogeneous(*problem, sketch, solver, stop);
    if (!fit) return fit.error();
    least = std::min(least, fit->reduced_scattering + fit->absorption);
  }
  const double margin = options.direct_light_paths / least;
  log::info(
      "cells within {:.2f} mm of directly lit ones are left out: {} mean free paths of {:.2f} mm",
      margin,
      options.direct_light_paths,
      1.0 / least);
  return margin;
}

Dataset without_direct_light(const Dataset& dataset, double margin_mm) {
  Dataset masked = dataset;
  if (dataset.lit_face != dataset.seen_face) return masked;
  for (Illumination& i : masked.illuminations) {
    mask_direct_light(masked.block, masked.lit_face, i.irradiance, margin_mm, i.mask);
  }
  return masked;
}

}  // namespace opaline::reconstruct
