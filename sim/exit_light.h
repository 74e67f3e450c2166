#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "base/thread_team.h"
#include "sim/ball_transport.h"

namespace opaline::sim {

/// What a camera sees of a ball under light from all sides, cross-polarised, where its line of sight makes angles within one bin with the surface's normal n:
/// light remembers where it came from, so it depends on that angle by more than a law of its own.
struct ExitLight {
  double cosine = 0.0;       ///< of that angle, its mean over the light
  double reflectance = 0.0;  ///< radiance over that of the constant light
  double reflectance_deviation = 0.0;
  double ratio = 0.0;  ///< constant light over the length of the gradients' vector
  double ratio_deviation = 0.0;
  double tilt = 0.0;  ///< radians from n to the gradients' vector, away from the camera
  double tilt_deviation = 0.0;
};

/// As trace_ball() does, sorted by the direction in which light leaves; bins between `edges` of the cosine's square, 0 to 1, rising.
/// Errors: kInvalidArgument.
Result<std::vector<ExitLight>> trace_exit_light(const Ball& ball,
                                                std::span<const double> edges,
                                                std::int64_t paths,
                                                std::uint64_t seed,
                                                ThreadTeam& team);

}  // namespace opaline::sim
