#include "base/camera_json.h"

#include <array>

namespace opaline {

nlohmann::ordered_json camera_to_json(const CameraModel& camera) {
  const Vec3 t = camera.camera_from_sample.translation;
  return {{"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"distortion", camera.distortion},
          {"rotation", camera.camera_from_sample.rotation},
          {"translation_mm", {t.x, t.y, t.z}}};
}

CameraModel camera_from_json(const nlohmann::json& in) {
  CameraModel camera;
  in.at("width").get_to(camera.width);
  in.at("height").get_to(camera.height);
  in.at("fx").get_to(camera.fx);
  in.at("fy").get_to(camera.fy);
  in.at("cx").get_to(camera.cx);
  in.at("cy").get_to(camera.cy);
  in.at("distortion").get_to(camera.distortion);
  in.at("rotation").get_to(camera.camera_from_sample.rotation);
  const auto t = in.at("translation_mm").get<std::array<double, 3>>();
  camera.camera_from_sample.translation = {t[0], t[1], t[2]};
  return camera;
}

}  // namespace opaline
