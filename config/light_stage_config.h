#pragma once

#include <array>
#include <cstdint>
#include <optional>
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

/// [light_stage.beam]: a thin beam, of a laser or of a projector that shows one spot, on the channel behind the last lamp's.
struct BeamConfig {
  double power_w = 0.0;  ///< at full code, of each channel; 0: there is none
  std::array<double, 3> position_mm{
      0.0, 60.0, 590.0};           ///< where it comes from, in the sphere's frame
  std::array<double, 3> aim_mm{};  ///< what it is aimed at
};

/// [light_stage] of a rig file: where the lamps are, how bright, and what they hang on.
struct LightStageConfig {
  StageDriver driver = StageDriver::kNone;
  int lamps = 156;  ///< of an even sphere (light_sphere_directions), where no positions are given
  double radius_mm = 600.0;              ///< of that sphere
  double intensity = 1.0;                ///< of every lamp, W/sr, where no intensities are given
  std::vector<double> positions;         ///< x, y, z of each lamp, mm; none: that sphere
  std::vector<double> intensities;       ///< one a lamp; none: all `intensity`
  std::vector<std::int64_t> dead_lamps;  ///< known to be; from 0
  double depolarised = 0.5;  ///< share of depolarised light that passes the crossed polarisers
  BeamConfig beam;
  drivers::UdmxOptions udmx;  ///< without its lights

  bool has_beam() const { return beam.power_w > 0.0; }
  /// Dead ones with intensity 0; behind them the beam, if there is one, as a lamp of intensity 0, which no pattern lights.
  std::vector<SphereLight> lights() const;
};

/// What a simulated one shines.
std::optional<sim::LedBeam> sim_beam(const LightStageConfig& stage);

void visit_light_stage(Fields& fields, LightStageConfig& stage);
/// [sim.sphere]
void visit_sim_sphere(Fields& fields, sim::LedSphereOptions& sphere, double& drift_per_hour);

}  // namespace opaline::config
