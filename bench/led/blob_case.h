#pragma once

#include <cstdint>
#include <string>

#include "base/thread_team.h"

namespace opaline::bench {

/// What is found on smooth blobs and dents whose light is traced from every pixel (sim/led_blob.h), among 156 lamps; `only` one, or all.
void measure_blobs(ThreadTeam& team, std::int64_t paths_per_pixel, const std::string& only);

}  // namespace opaline::bench
