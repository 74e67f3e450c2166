#pragma once

#include <nlohmann/json.hpp>

#include "base/camera_model.h"

namespace opaline {

/// A camera as files keep it: width height fx fy cx cy distortion rotation translation_mm.
nlohmann::ordered_json camera_to_json(const CameraModel& camera);
/// Throws nlohmann's exceptions on what is missing or of another type: the reader of the whole file catches.
CameraModel camera_from_json(const nlohmann::json& in);

}  // namespace opaline
