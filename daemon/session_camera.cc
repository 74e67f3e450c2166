#include "daemon/session_camera.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

namespace opaline::daemon {
namespace {

constexpr int kFormat = 1;

std::filesystem::path camera_file(const SessionDirectory& session) {
  return session.calibration().parent_path() / "camera.json";
}

nlohmann::ordered_json to_json(const CameraModel& camera) {
  const Vec3 t = camera.camera_from_sample.translation;
  return {{"format", kFormat},
          {"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"distortion", camera.distortion},
          {"rotation", camera.camera_from_sample.rotation},
          {"translation_mm", {t.x, t.y, t.z}}};
}

}  // namespace

Result<void> keep_camera(const SessionDirectory& session,
                         FileOperations& files,
                         const CameraModel& camera) {
  const auto file = camera_file(session);
  if (auto made = files.make_directories(file.parent_path()); !made) return made;
  return write_whole(files, file, to_json(camera).dump(2) + "\n");
}

Result<CameraModel> session_camera(const SessionDirectory& session, const CameraModel& given) {
  const auto file = camera_file(session);
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return given;
  const auto text = read_text(file);
  if (!text) return text.error();
  try {
    const auto json = nlohmann::json::parse(*text);
    if (json.at("format") != kFormat)
      return invalid_argument(fmt::format("{}: of a newer version", file.string()));
    CameraModel camera;
    json.at("width").get_to(camera.width);
    json.at("height").get_to(camera.height);
    json.at("fx").get_to(camera.fx);
    json.at("fy").get_to(camera.fy);
    json.at("cx").get_to(camera.cx);
    json.at("cy").get_to(camera.cy);
    json.at("distortion").get_to(camera.distortion);
    json.at("rotation").get_to(camera.camera_from_sample.rotation);
    const auto t = json.at("translation_mm").get<std::array<double, 3>>();
    camera.camera_from_sample.translation = {t[0], t[1], t[2]};
    return camera;
  } catch (const nlohmann::json::exception& e) {
    return invalid_argument(fmt::format("{}: damaged: {}", file.string(), e.what()));
  }
}

}  // namespace opaline::daemon
