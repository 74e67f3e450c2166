#pragma once

#include <string>

#include "daemon/report/report_data.h"

namespace opaline::daemon {

/// results.json: every figure of the report, for programs. Relative errors are shares, not per
/// cent; what could not be computed is null.
///
///   relighting_error, relighting_noise_floor   over the pixels of all held-out lights
///   bssrdf_error, bssrdf_noise                 E over the entry patches, and the part of it that
///                                              is the stored transport's own noise
///   seconds, seconds_per_stage                 with the report's plots
///   relighting, bssrdf, fit                    the same per light, per channel, per region
///   capture                                    saturated share per light, lights taken again
///   pictures                                   radiance shown as white, ends of the differences' scale
///   reconstruction, settings_toml, assumptions, versions
std::string results_json(const ReportData& data);

}  // namespace opaline::daemon
