#pragma once

#include <cstdint>
#include <string>

#include "base/thread_team.h"

namespace opaline::bench {

/// Lamps (346, 156, 60), exposures, smoothing windows and estimators against the error of D and the time of capture and computing, on two balls in a
/// simulated stage. Prints each setting's figures, and which of them are on the front; draws them when `plot` names an SVG file (bench/front.h).
/// Returns the program's exit status.
int measure_tradeoff(std::int64_t paths, const std::string& plot, ThreadTeam& team);

}  // namespace opaline::bench
