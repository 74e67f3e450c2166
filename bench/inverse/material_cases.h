#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/transport_responses.h"
#include "sim/light_transport.h"
#include "sim/scene.h"

namespace opaline::bench {

/// A sample of 24 x 24 mm whose light transport the Monte Carlo simulates: three materials, lit by 8 x 8 patches of
/// perpendicular light from behind (6 mm thick, camera 10 degrees off the normal) or from in front (12 mm, 20 degrees).
struct MaterialCase {
  std::string name;  ///< "marble back-lit"
  sim::SceneOptions scene;
  sim::ResponseOptions transport;
};

/// "marble-back", "marble-front", and so on for wax and stone.
std::vector<std::string> material_case_names();
std::optional<MaterialCase> material_case(const std::string& name);

/// From `cache`, or traced and put there: one to some minutes, with progress on stderr.
Result<TransportResponses> responses_of(const MaterialCase& material,
                                        const std::filesystem::path& cache);

}  // namespace opaline::bench
