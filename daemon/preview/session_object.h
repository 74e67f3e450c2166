#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "base/image.h"
#include "config/session_config.h"
#include "daemon/jobs/job.h"
#include "daemon/render/scene_view.h"

namespace opaline::daemon {

/// An object of a session's material as the preview has drawn it.
struct ObjectView {  // NOLINT(bugprone-exception-escape): a null JSON value throws nothing
  Image<std::uint8_t> picture;  ///< sRGB
  nlohmann::json statistics;    ///< render_report.h, with "white", W/(mm^2 sr)
  std::string drawn_by;
  std::string absent;  ///< why there is none

  bool is_drawn() const { return absent.empty(); }
};

/// Reads preview/object.toml, or writes it first where there is none (object_scene.h), and draws it by the renderer of
/// "opaline render" (DrawBy::kAuto): preview/object.png, object.exr, and object.json, its statistics. `step` hears how far it
/// is. A scene that cannot be drawn is no error: `absent` says why. Errors: kCancelled; those of writing.
Result<ObjectView> draw_object(JobContext& job,
                               const config::SessionConfig& config,
                               const gpu::ContextOptions& gpu,
                               const std::function<void(double share)>& step);

}  // namespace opaline::daemon
