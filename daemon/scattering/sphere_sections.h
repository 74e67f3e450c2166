#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "config/session_config.h"
#include "daemon/scattering/beam_measurement.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_truth.h"

namespace opaline::daemon {

/// Parts of a sphere's report, as HTML.

/// Found by the beam, by the maps around it, and what is true where that is known.
std::string beam_table(const BeamMeasurement& beam, const sim::LedSphereOptions* simulated);
std::string truth_section(const SphereTruth& truth);
/// Why pixels have no answer, how many, and where (`png`; none: empty).
std::string reasons_section(const SphereMaps& maps,
                            const SphereSession& session,
                            std::span<const std::byte> png);
/// What was assumed, and every setting.
std::string assumptions_section(const config::SessionConfig& config, const SphereSession& session);

}  // namespace opaline::daemon
