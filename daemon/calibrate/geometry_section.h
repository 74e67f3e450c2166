#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "calibration/record.h"

namespace opaline::daemon {

/// The step "geometry" for a report, as HTML; empty where it has not been done. What was left of each corner of each pose (arrows) and how
/// that is distributed, where in both pictures corners were, how the board was tilted, both lenses with how far they have drifted since
/// `before`, and which poses were left out, and why. `poses_png`: the poses with their corners; empty: none.
std::string geometry_section(const calibration::Record& record,
                             const std::optional<calibration::Record>& before,
                             std::span<const std::byte> poses_png,
                             const std::stop_token& stop);

}  // namespace opaline::daemon
