#pragma once

#include <cstdint>

#include "base/thread_team.h"

namespace opaline::bench {

/// The corrected formula against what it is made from, and against the cosine integral that it approximates.
void measure_formulas();
/// Table, corrected dipole, the formula and the line as published, each against balls traced anew of materials that are not in the table.
void measure_materials(ThreadTeam& team, std::int64_t paths);
/// The reference method of the paper's Table 1 on the same balls: a dipole fitted to what a thin beam makes leave, from 2 mean free paths to 8 l_d away.
void measure_beams(ThreadTeam& team, std::int64_t paths);
/// Maps of a ball with 1 % noise in each pixel.
void measure_noise(ThreadTeam& team, std::int64_t paths);

}  // namespace opaline::bench
