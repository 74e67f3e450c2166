#pragma once

#include <cstdint>
#include <string>

#include "base/thread_team.h"

namespace opaline::bench {

/// Balls in a sphere of 156 lamps, photographed by a camera: what a session reaches.
void measure_stage(ThreadTeam& team, std::int64_t paths);
/// What is found on smooth blobs and dents whose light is traced from every pixel (sim/led_blob.h), among 156 lamps; `only` one, or all.
void measure_blobs(ThreadTeam& team, std::int64_t paths_per_pixel, const std::string& only);
/// Materials, indices, lamps and pictures at the end of what is measured, and beyond it.
void measure_extremes(ThreadTeam& team, std::int64_t paths);

}  // namespace opaline::bench
