#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "base/thread_team.h"
#include "sim/ball_transport.h"

namespace opaline::sim {

/// What a thin beam that enters a ball along its normal makes leave around it, cross-polarised: only what has scattered more than once.
struct BeamProfile {
  std::vector<double>
      distance;  ///< arc along the surface to the middle of each ring, mean free paths
  std::vector<double>
      exitance;  ///< power leaving over area and over the beam's power, 1/(mean free path)^2
  std::vector<double> deviation;  ///< standard deviation of it
};

/// Monte Carlo (BallWalk) in `rings` of equal width out to `reach` mean free paths (less than a quarter turn). The surface's own reflection is no
/// part of it. Deterministic in `seed`, whatever the threads. Errors: kInvalidArgument, kCancelled.
Result<BeamProfile> trace_beam(const Ball& ball,
                               double reach,
                               int rings,
                               std::int64_t paths,
                               std::uint64_t seed,
                               ThreadTeam& team,
                               std::stop_token stop);

}  // namespace opaline::sim
