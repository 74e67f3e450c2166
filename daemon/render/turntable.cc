#include "daemon/render/turntable.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace opaline::daemon {
namespace {

/// Rodrigues' rotation about an axis of length 1.
Vec3 rotated(Vec3 v, Vec3 axis, double radians) {
  const double c = std::cos(radians);
  return v * c + cross(axis, v) * std::sin(radians) + axis * (dot(axis, v) * (1.0 - c));
}

}  // namespace

TurnedView turned(const render::Scene& scene, double degrees) {
  const Vec3 axis = normalized(scene.camera.up);
  const Vec3 pivot = scene.camera.target;
  const double back = -degrees * std::numbers::pi / 180.0;
  const auto moved = [&](Vec3 place) { return pivot + rotated(place - pivot, axis, back); };
  TurnedView view{scene.camera, scene.lights};
  view.camera.position = moved(scene.camera.position);
  for (render::LightOptions& light : view.lights) {
    light.position = moved(light.position);
    light.direction = rotated(light.direction, axis, back);
  }
  return view;
}

std::filesystem::path numbered(const std::filesystem::path& file, int picture, int pictures) {
  if (pictures <= 1) return file;
  const auto digits = static_cast<int>(fmt::format("{}", pictures - 1).size());
  std::filesystem::path name = file;
  name.replace_filename(
      fmt::format("{}_{:0{}}{}", file.stem().string(), picture, digits, file.extension().string()));
  return name;
}

}  // namespace opaline::daemon
