#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/dataset.h"
#include "base/events.h"
#include "base/result.h"
#include "base/uncertainty.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/error_budget.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"
#include "reconstruct/posterior.h"

namespace opaline::reconstruct {

/// How well the logarithm of one coefficient is known, through the depth. Standard deviations.
struct DeviationByDepth {
  double prior = 0.0;          ///< before a picture is seen
  double amplitude = 0.0;      ///< of a cell about the level: all that is known of it is the level
  std::vector<double> layers;  ///< root mean square of each layer, from the seen face inwards
};

/// How well one channel of a material is known.
struct ChannelUncertaintyReport {
  DeviationByDepth absorption;          ///< of log sigma_a
  DeviationByDepth reduced_scattering;  ///< of log sigma_s'
  DeviationByDepth diffusion;           ///< of log kappa
  double determined_diffusion = 0.0;    ///< numbers of log kappa that the pictures determine
  double determined_absorption = 0.0;
  long solves = 0;  ///< for one right-hand side
  double seconds = 0.0;
};

struct UncertaintyResult {
  MaterialUncertainty material;
  std::array<ChannelUncertaintyReport, kColorChannels> channels;
  double length_mm = 0.0;  ///< correlation length of the prior
  double layer_mm = 0.0;   ///< thickness of a layer of cells
  double seconds = 0.0;
  std::optional<ErrorBudget> budget;  ///< where lights were held out
};

/// What the computation works with; all of it outlives the call.
struct UncertaintyContext {
  diffusion::FluenceSolver& solver;
  EventSink& events;
  const Clock& clock;
};

/// The posterior (reconstruct/posterior.h) of each channel at what reconstruct_reduced() found in `dataset`, on the
/// dataset's own grid and from the same pictures, masks and weights; options.model_error is also its discrepancy. Nothing where every channel came out homogeneous: the
/// 95 % intervals of its two numbers (reconstruct/homogeneous_fit.h) say it all.
///
/// Events: progress "uncertainty" before each channel and at the end, {channel}.
/// Errors: those of posterior(); kCancelled.
Result<std::optional<UncertaintyResult>> material_uncertainty(const Dataset& dataset,
                                                              const InverseOptions& options,
                                                              const InverseResult& found,
                                                              const PosteriorOptions& posterior,
                                                              const UncertaintyContext& context,
                                                              std::stop_token stop);

/// "uncertainty" of reconstruction.json:
///
///   length_mm, layer_mm, seconds
///   channels [{channel, determined_diffusion, determined_absorption, solves, seconds,
///              absorption, reduced_scattering, diffusion {prior, amplitude, layers [..]}}]
///
///   error_budget {measured, noise, calibration, model, discretisation, undetermined, sum}   where lights were held out
///
/// deviations of natural logarithms, layers from the seen face inwards.
nlohmann::ordered_json to_json(const UncertaintyResult& uncertainty);

}  // namespace opaline::reconstruct
