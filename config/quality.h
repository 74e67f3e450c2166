#pragma once

#include "config/session_config.h"

namespace opaline::config {

/// Sets every dial behind a quality; what is written in a file is read after it and wins. The figures behind the choice,
/// measured on the simulated rig, stand in docs/accuracy.md (scripts/bench tradeoff measures them again).
///
///                                          draft  standard  reference
///   capture.regions                        2      4         8
///   capture.exposures.ratio, wanted_snr    8, 25  4, 50     2, 100
///   capture.exposures.planned_snr          50     100       200
///   reconstruction.grid_step               2      1         1
///   reconstruction.grid_correction         no     no        yes
///   reconstruction.tolerance               1e-3   1e-5      1e-6
///   reconstruction.max_iterations          20     150       1000
///   reconstruction.discrepancy, stalled    0.1, 0.01        0, 0.002
///   preview.samples_per_axis, tolerance    1, 1e-4 2, 1e-6  4, 1e-8
///   preview.object_tetrahedra              15,000 60,000    200,000
void apply(Quality quality, SessionConfig& session);

}  // namespace opaline::config
