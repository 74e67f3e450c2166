#pragma once

#include <cstdint>

#include "base/result.h"
#include "base/thread_team.h"

namespace opaline::sim {

/// A homogeneous ball that scatters isotropically (similarity: g = 0, the reduced albedo). Lengths in transport mean free paths 1/sigma_t'.
struct Ball {
  double reduced_albedo = 0.99;  ///< alpha', 0 to 1 (1 excluded)
  double radius = 30.0;          ///< >= 1
  double ior = 1.4;              ///< 1 to 3
};

/// Errors: kInvalidArgument outside the ranges above.
Result<void> check(const Ball& ball);

/// What leaves the ball under light from all sides, cross-polarised: only what has scattered more than once.
struct BallLight {
  double reflectance = 0.0;            ///< flux out over flux in, constant light
  double reflectance_deviation = 0.0;  ///< standard deviation of its mean
  double ratio =
      0.0;  ///< r: constant light over the gradient omega . n, n the normal where the light leaves
  double ratio_deviation = 0.0;
  /// The gradients' vector leaves the normal, away from the camera, by tilt times the sine of the angle between them (fitted over all angles): a
  /// slanted look sees light that came in aside (exit_light.h sorts it by angle).
  double tilt = 0.0;
};

/// Monte Carlo in the ball: light enters one point from the hemisphere's directions omega (cosine law, stratified), refracts, walks with its
/// weight times alpha' a collision, is mirrored inside by Fresnel's chance and leaves elsewhere, where it counts 1 and omega . n. By
/// symmetry that is the point's radiant exitance under constant and under gradient light. Deterministic: the numbers hash from the
/// seed and the path, whatever the threads.
///
/// Errors: kInvalidArgument.
Result<BallLight> trace_ball(const Ball& ball,
                             std::int64_t paths,
                             std::uint64_t seed,
                             ThreadTeam& team);

}  // namespace opaline::sim
