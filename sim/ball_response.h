#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "base/thread_team.h"
#include "sim/ball_transport.h"

namespace opaline::sim {

/// What one small light far from a ball makes leave it by subsurface transport, cross-polarised: only what has scattered more than once. It
/// depends on the angle theta between the surface normal and the direction from the ball's centre to the light alone.
struct BallResponse {
  /// Radiant exitance over I / d^2, I the light's intensity, d its distance from the ball's centre, in equal steps of theta from 0 to pi,
  /// means over each.
  std::vector<double> exitance;
  /// Radiance towards an angle over exitance / pi, in equal steps of the angle's cosine from 0 to 1, means over each weighed by the cosine;
  /// under light from all sides. int_0^1 law mu dmu = 1/2.
  std::vector<double> exit_law;

  double exitance_at(double cosine) const;  ///< interpolated, of cos(theta)
  double law_at(double cosine) const;       ///< of the angle between normal and camera
};

struct ResponseSize {
  std::int64_t paths = 1'000'000;  ///< >= 10000
  int angles = 96;                 ///< of exitance; >= 8
  int cosines = 16;                ///< of exit_law; >= 4
};

/// Monte Carlo (BallWalk) of a light `light_distance` ball radii from the centre, > 1. Radiance is taken to be exitance times exit_law:
/// a direction that depends on where the light came from is forgotten. Deterministic in `seed`, whatever the threads.
/// Errors: kInvalidArgument, kCancelled.
Result<BallResponse> trace_response(const Ball& ball,
                                    double light_distance,
                                    const ResponseSize& size,
                                    std::uint64_t seed,
                                    ThreadTeam& team,
                                    std::stop_token stop);

}  // namespace opaline::sim
