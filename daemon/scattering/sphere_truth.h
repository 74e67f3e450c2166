#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "config/session_config.h"
#include "daemon/scattering/sphere_maps.h"

namespace opaline::daemon {

/// One ball of a simulated sphere, one channel: what the maps say of it against what it is, over the pixels that have an answer.
struct BallErrors {
  double radius_mm = 0.0;
  int channel = 0;
  double diffusion_mm = 0.0;      ///< the truth
  double reduced_albedo = 0.0;    ///< the truth
  double median_diffusion = 0.0;  ///< found
  double median_albedo = 0.0;     ///< found
  double within_two_sigma = 0.0;  ///< share of the pixels whose ln D is
  int found = 0;                  ///< pixels
  int seen = 0;
};

struct SphereTruth {
  std::vector<BallErrors> balls;       ///< ball by ball, red green blue
  double mean_normal_error_deg = 0.0;  ///< of mean_normals(), over measured pixels
};

/// What a simulated session's maps are worth; `rig` is its rig's configuration, whose stage is simulated.
SphereTruth compare_with_truth(const SphereMaps& maps,
                               const Image<std::uint8_t>& measured,
                               const StageRecord& record,
                               const config::RigConfig& rig);

}  // namespace opaline::daemon
