#include "daemon/calibrate/calibration_terminal.h"

#include <fmt/format.h>

#include "calibration/pose_guide.h"

namespace opaline::daemon {
namespace {

using calibration::PoseGuide;

// One row of the picture's fields: "# # . . ".
std::string field_row(const nlohmann::json& fields, int row) {
  std::string line;
  for (int i = 0; i < PoseGuide::kAcross; ++i) {
    const auto index = static_cast<std::size_t>(row * PoseGuide::kAcross + i);
    line += index < fields.size() && fields[index].get<int>() > 0 ? "# " : ". ";
  }
  return line;
}

std::string tilt_text(const nlohmann::json& tilts, const char* way, const char* meaning) {
  return fmt::format("{:>3} {}", tilts.value(way, 0), meaning);
}

}  // namespace

std::vector<std::string> pose_lines(const nlohmann::json& pose) {
  std::string text = pose.value("message", "");
  std::vector<std::string> lines;
  const std::size_t next = text.find("; next: ");
  lines.push_back(text.substr(0, next));
  const auto fields = pose.value("fields", nlohmann::json::array());
  const auto tilts = pose.value("tilts", nlohmann::json::object());
  const std::array<std::string, PoseGuide::kDown> beside{
      "poses by the edge that is nearer:",
      tilt_text(tilts, "left", "left"),
      tilt_text(tilts, "right", "right"),
      tilt_text(tilts, "top", "upper"),
      tilt_text(tilts, "bottom", "lower"),
      tilt_text(tilts, "flat", "none: parallel to the picture")};
  for (int row = 0; row < PoseGuide::kDown; ++row)
    lines.push_back(
        fmt::format("    {}  {}", field_row(fields, row), beside[static_cast<std::size_t>(row)]));
  if (next != std::string::npos) lines.push_back("  " + text.substr(next + 2));
  return lines;
}

void CalibrationTerminal::progress(const Progress& p) {
  if (attendant_ != nullptr) attendant_->doing(p.step, p.detail.value("doing", ""));
  view_.on_event("progress", {{"step", p.step}, {"fraction", p.fraction}, {"detail", p.detail}});
}

Result<void> CalibrationTerminal::fact(std::string_view type, const nlohmann::json& data) {
  if (type == "pose.taken" && pictures_) {
    for (const std::string& line : pose_lines(data)) view_.say(line);
  } else {
    view_.say(data.value("message", data.dump()));
  }
  return ok();
}

}  // namespace opaline::daemon
