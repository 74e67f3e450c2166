#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "config/light_stage_config.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_session.h"
#include "reconstruct/spherical_gradient/beam_fit.h"

namespace opaline::daemon {

/// One channel of the light around a thin beam, in rings about where it enters.
struct BeamChannel {
  std::vector<double> distance_mm;  ///< straight, as the dipole counts it
  std::vector<double> exitance;     ///< over the power that entered, 1/mm^2
  std::vector<double> deviation;    ///< standard deviation of its logarithm
  std::optional<reconstruct::BeamParameters> found;
  std::string why_not;  ///< where nothing was found
  /// Medians of the maps over the same pixels; 0 where they have no answer.
  double map_translucency = 0.0;
  double map_diffusion = 0.0;
  double map_albedo = 0.0;
};

/// The reference method of the paper's Table 1 on the session's own object: a dipole fitted to "beam", the picture of the thin beam alone. Rings lie from two
/// mean free paths, by the maps' median, to eight l_d; radiance becomes exitance by the exit law of even light; distances by the relief of the normals.
struct BeamMeasurement {
  double spot_x = 0.0;  ///< pixels
  double spot_y = 0.0;
  std::array<BeamChannel, 3> channels;
};
/// None where the session has no such picture. Errors: kInvalidArgument where the beam is not seen on the object.
Result<std::optional<BeamMeasurement>> measure_beam(const SphereMaps& maps,
                                                    const SphereSession& session,
                                                    const config::BeamConfig& beam,
                                                    double ior);

/// For reconstruction.json.
nlohmann::ordered_json to_json(const BeamMeasurement& measurement);

}  // namespace opaline::daemon
