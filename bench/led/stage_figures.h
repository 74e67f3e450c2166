#pragma once

#include <cstdint>

#include "base/thread_team.h"

namespace opaline::bench {

/// Balls in a sphere of 156 lamps, photographed by a camera: what a session reaches.
void measure_stage(ThreadTeam& team, std::int64_t paths);
/// Materials, indices, lamps and pictures at the end of what is measured, and beyond it.
void measure_extremes(ThreadTeam& team, std::int64_t paths);

}  // namespace opaline::bench
