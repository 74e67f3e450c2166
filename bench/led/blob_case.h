#pragma once

#include <cstdint>

#include "base/thread_team.h"

namespace opaline::bench {

/// What is found on smooth blobs, with dents, with two materials, whose light is traced from every pixel (sim/led_blob.h), among 156 lamps.
void measure_blobs(ThreadTeam& team, std::int64_t paths_per_pixel);

}  // namespace opaline::bench
