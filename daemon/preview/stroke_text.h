#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"

namespace opaline::daemon {

/// A stroke that came as JSON, as the table of a scene file that says the same:
///
///   {"operation": "scale", "value": [1, 4, 8], "centre_mm": [0, 0, 3], "radius_mm": 2}
///   -> [[objects.edits]] ... centre = ["0 mm", "0 mm", "3 mm"] ...
///
/// Known are operation, quantity, reach (strings); value, direction (three numbers); strength, softness; and in mm centre_mm
/// (three), radius_mm, depth_mm, thickness_mm. Ranges are the scene file's business. No file can be named.
/// Errors: kInvalidArgument, naming the key.
Result<std::string> stroke_text(const nlohmann::json& stroke);

}  // namespace opaline::daemon
