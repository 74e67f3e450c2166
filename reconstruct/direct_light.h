#pragma once

#include <stop_token>

#include "base/dataset.h"
#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// How far around directly lit cells a picture of the lit face is left out (docs/physics.md, "How light enters"):
///
///   margin = direct_light_paths / sigma_t',   sigma_t' = sigma_s' + sigma_a
///
/// of the channel with the longest mean free path. sigma_t' is not known when the picture is taken: it is that of the
/// homogeneous sample which explains the pictures best, cells that the capture left out not counted. The model's error
/// beside a lit patch is some percent there, so the fit is good enough to say where it is.
///
/// 0 when another face than the lit one is seen. Errors: make_channel_problem()'s, the solver's; kCancelled.
Result<double> direct_light_margin(const Dataset& dataset,
                                   const InverseOptions& options,
                                   diffusion::FluenceSolver& solver,
                                   std::stop_token stop);

/// The dataset with the cells masked that lie within `margin_mm` of directly lit ones; unchanged when another face
/// than the lit one is seen.
Dataset without_direct_light(const Dataset& dataset, double margin_mm);

}  // namespace opaline::reconstruct
