#pragma once

#include <filesystem>
#include <vector>

#include "render/scene/scene.h"

namespace opaline::daemon {

/// A scene's objects turned by an angle about the camera's `up` through its target, camera and lights standing still; told
/// the other way round, since what was prepared of the objects stays: camera and lights turned back.
struct TurnedView {
  render::CameraOptions camera;
  std::vector<render::LightOptions> lights;
};
TurnedView turned(const render::Scene& scene, double degrees);

/// "torus.png" -> "torus_007.png" of 120 pictures; as it is where there is one.
std::filesystem::path numbered(const std::filesystem::path& file, int picture, int pictures);

}  // namespace opaline::daemon
