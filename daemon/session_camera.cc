#include "daemon/session_camera.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/camera_json.h"

namespace opaline::daemon {
namespace {

constexpr int kFormat = 1;

std::filesystem::path camera_file(const SessionDirectory& session) {
  return session.calibration().parent_path() / "camera.json";
}

}  // namespace

Result<void> keep_camera(const SessionDirectory& session,
                         FileOperations& files,
                         const CameraModel& camera) {
  const auto file = camera_file(session);
  if (auto made = files.make_directories(file.parent_path()); !made) return made;
  nlohmann::ordered_json json{{"format", kFormat}};
  json.update(camera_to_json(camera));
  return write_whole(files, file, json.dump(2) + "\n");
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
    return camera_from_json(json);
  } catch (const nlohmann::json::exception& e) {
    return invalid_argument(fmt::format("{}: damaged: {}", file.string(), e.what()));
  }
}

}  // namespace opaline::daemon
