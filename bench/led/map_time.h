#pragma once

#include "base/thread_team.h"

namespace opaline::bench {

/// Seconds that the maps of ten megapixels take, and a per-pixel optimiser over the same table.
void measure_time(ThreadTeam& team);

}  // namespace opaline::bench
