#pragma once

#include <string>

#include "base/dataset.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/inverse_result.h"

namespace opaline::reconstruct {

/// reconstruction.json, for the report and for scripts:
///
///   format      1
///   solver, seconds
///   fitted, held_out     {relighting_error, noise_floor}
///   options     {source, deposit, boundary, model_error, regularization, ...}: as used
///   channels    [{channel, model, model_reason, held_out_noise_chi_squared_per_datum, cross_validated,
///                 ladder [{model, parameters, fitted_chi_squared_per_datum, held_out_chi_squared_per_datum,
///                         held_out_standard_error, gain, gain_standard_error, solves, seconds, taken, why}],
///                 homogeneous {reduced_scattering, absorption, ..._interval_95 [from, to] or null,
///                              chi_squared_per_datum, iterations},
///                 stop_reason, stop_explanation, data, solves, seconds, chi_squared_per_datum,
///                 history [{iteration, objective, chi_squared_per_datum, regularization, solves}]}]
///   illuminations [{name, held_out, relighting_error}]
std::string summary_json(const Dataset& dataset,
                         const InverseOptions& options,
                         const InverseResult& result);

}  // namespace opaline::reconstruct
