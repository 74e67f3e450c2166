#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "calibration/record.h"

namespace opaline::daemon {

/// Each a <figure>; empty where the calibration has nothing to draw. Variance against light, by channel, with the fitted line.
std::string photon_transfer_plot(const calibration::Record& record, const std::stop_token& stop);
/// The response as Debevec and Malik have it, and the one in use, against codes; and the difference.
std::string response_plot(const calibration::Record& record, const std::stop_token& stop);
/// Exposure times, measured over reported, per cent off.
std::string exposure_plot(const calibration::Record& record, const std::stop_token& stop);
/// Codes above black in the dark, over the picture.
std::string dark_map_plot(const calibration::Record& record, const std::stop_token& stop);
/// CIEDE2000 of each patch of the chart, left out of the fit, by both models.
std::string patch_plot(const calibration::Record& record, const std::stop_token& stop);
/// Every gate's figure as a share of its limit, now and before.
std::string gate_plot(const calibration::Record& record,
                      const std::optional<calibration::Record>& before,
                      const std::stop_token& stop);

}  // namespace opaline::daemon
