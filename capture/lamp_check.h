#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/light_sphere.h"
#include "base/result.h"
#include "capture/region_taker.h"

namespace opaline::capture {

/// Finds lamps that do not shine, by lighting each alone: a dead one of 156 in front of an object makes D wrong by more than is stated of it.
/// Only lamps on the camera's side are tried (their direction within 95 degrees of `towards_camera`): what the others light is not seen.
///
/// A lamp is dead when the object shows less than a tenth of the median of what it shows under the six lamps nearest to it. Lamps that are
/// believed to be dead are not tried.
struct LampCheck {
  std::vector<int> tried;
  std::vector<int> dead;
};
/// `light` is what the object showed under each of `tried`, in any unit. The judgement alone.
std::vector<int> dead_lamps(std::span<const SphereLight> lights,
                            std::span<const int> tried,
                            std::span<const double> light);

/// `taker` takes one good exposure of each (its options want a low signal); `told` hears of each lamp before it is lit. Errors: as RegionTaker.
Result<LampCheck> check_lamps(RegionTaker& taker,
                              const BlackFrames& black,
                              const CameraCalibration& camera,
                              std::span<const SphereLight> lights,
                              Vec3 towards_camera,
                              const std::function<void(int lamp, int of)>& told,
                              std::stop_token stop);

}  // namespace opaline::capture
