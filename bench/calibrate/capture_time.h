#pragma once

#include <string>

#include "base/result.h"
#include "sim/scene.h"

namespace opaline::bench {

/// How long a sample's lights (4 x 4 regions and 8 held out) are exposed for, seconds, black frames included but for the limit,
/// for SNR 100 in 95 % of the cells in every channel (ExposureOptions). Lights that the fixed exposures do not reach it for
/// are left out.
struct CaptureTime {
  double fixed = 0.0;     ///< by the whole ladder of 1/30 to 8 s, each four times the one before
  double one_stop = 0.0;  ///< by exposures of 1/30 to 8 s, each twice the one before
  double planned = 0.0;   ///< by plan
  double planned_black = 0.0;  ///< of that, black frames
  double photon_limit = 0.0;   ///< sum of photon_limit() over the lights
  double share_reached =
      1.0;  ///< the least over the lights, by the light that the fixed exposures tell
  double realised =
      1.0;  ///< SNR^2 of repeated captures over what the merge says, mean over cells of some lights
  int out_of_reach = 0;  ///< lights left out
};
Result<CaptureTime> capture_time(const sim::SceneOptions& scene);

}  // namespace opaline::bench
