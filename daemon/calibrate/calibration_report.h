#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "calibration/record.h"

namespace opaline::daemon {

/// A calibration as a page of HTML that needs no other file: every gate with its figure and limit, what was measured and how it has
/// drifted since `before`, the plots of calibration_plots.h, and geometry_section.h's. A plot that cannot be drawn carries the reason.
/// `poses_png`: the poses of the board as they were seen; empty: none.
std::string calibration_page(const calibration::Record& record,
                             const std::optional<calibration::Record>& before,
                             std::span<const std::byte> poses_png,
                             const std::stop_token& stop);

}  // namespace opaline::daemon
