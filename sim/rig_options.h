#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "sim/faults.h"
#include "sim/optics.h"
#include "sim/surface_reflectance.h"

namespace opaline::sim {

/// The simulated station; the defaults are the demo's.
struct RigOptions {
  std::uint64_t seed = 1;    ///< of everything random about it
  double time_factor = 1.0;  ///< how many times as fast as real time its clock runs; 1 to 1000
  CameraOptics camera;
  ProjectorOptics projector;
  SurfaceOptions surface;  ///< where the lit face is the one that is seen
  std::string identity;    ///< tells it from rigs of other options; whatever its builder likes
  Faults faults;           ///< to come, from the start
};
/// Errors: kInvalidArgument naming the option, its value and what was expected.
Result<void> validate(const RigOptions& options);

}  // namespace opaline::sim
