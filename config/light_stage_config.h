#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/light_sphere.h"
#include "config/fields.h"
#include "drivers/udmx/udmx_stage.h"
#include "sim/led_sphere.h"

namespace opaline::config {

/// Which back end drives the lamps.
enum class StageDriver : std::uint8_t {
  kNone,  ///< the station has a projector
  kSim,
  kUdmx,
};
inline constexpr std::array<std::string_view, 3> kStageDriverNames{"none", "sim", "udmx"};

/// [light_stage] of a rig file: where the lamps are, how bright, and what they hang on.
struct LightStageConfig {
  StageDriver driver = StageDriver::kNone;
  int lamps = 156;  ///< of an even sphere (light_sphere_directions), where no positions are given
  double radius_mm = 600.0;              ///< of that sphere
  double intensity = 1.0;                ///< of every lamp, W/sr, where no intensities are given
  std::vector<double> positions;         ///< x, y, z of each lamp, mm; none: that sphere
  std::vector<double> intensities;       ///< one a lamp; none: all `intensity`
  std::vector<std::int64_t> dead_lamps;  ///< known to be; from 0
  double depolarised = 0.5;   ///< share of depolarised light that passes the crossed polarisers
  drivers::UdmxOptions udmx;  ///< without its lights

  std::vector<SphereLight> lights() const;  ///< dead ones with intensity 0
};

void visit_light_stage(Fields& fields, LightStageConfig& stage);
/// [sim.sphere]
void visit_sim_sphere(Fields& fields, sim::LedSphereOptions& sphere, double& drift_per_hour);

}  // namespace opaline::config
