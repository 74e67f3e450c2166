#pragma once

#include <cstdint>
#include <string>

#include "base/thread_team.h"
#include "bench/led/stage_case.h"

namespace opaline::bench {

/// Prints led.share_left_out for every reason there was.
void print_reasons(const std::string& which, const StageErrors& errors);
/// Balls in a sphere of 156 lamps, photographed by a camera: what a session reaches.
void measure_stage(ThreadTeam& team, std::int64_t paths);
/// Materials, indices, lamps and pictures at the end of what is measured, and beyond it.
void measure_extremes(ThreadTeam& team, std::int64_t paths);

}  // namespace opaline::bench
