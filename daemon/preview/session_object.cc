#include "daemon/preview/session_object.h"

#include <algorithm>
#include <array>
#include <thread>
#include <utility>

#include "base/log.h"
#include "config/scene_config.h"
#include "daemon/preview/object_scene.h"
#include "daemon/render/developed_picture.h"
#include "daemon/render/render_report.h"

namespace opaline::daemon {
namespace {

constexpr double kReadyShare = 0.6;  // of the time until the light is sought, about

struct Drawn {
  Image<float> radiance;
  nlohmann::json statistics;
  std::string by;
};

Result<Drawn> drawn(const render::Scene& scene,
                    int threads,
                    const gpu::ContextOptions& gpu,
                    const std::function<void(double)>& step,
                    const std::stop_token& stop) {
  const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  ThreadTeam team(threads > 0 ? threads : processors);
  const auto view = SceneView::create(
      scene,
      DrawBy::kAuto,
      gpu,
      team,
      [&](std::string_view, double share) { step(kReadyShare * share); },
      stop);
  if (!view) return view.error();
  step(kReadyShare);
  auto radiance = (*view)->picture(scene.lights, scene.camera, stop);
  if (!radiance) return radiance.error();
  return Drawn{
      *std::move(radiance), to_json((*view)->renderer().statistics()), (*view)->description()};
}

Result<void> write_pictures(JobContext& job, const Drawn& picture, const render::Scene& scene) {
  const double white = picture.statistics["white"];
  const std::array outputs{std::pair{"object.png", ImageFormat::kPng},
                           std::pair{"object.exr", ImageFormat::kExr}};
  for (const auto& [name, format] : outputs) {
    const auto bytes = developed(picture.radiance, white, scene.picture, format);
    if (!bytes) return bytes.error().in(name);
    if (auto done = write_whole(job.files, job.session.preview() / name, *bytes); !done)
      return done;
  }
  return write_whole(
      job.files,
      job.session.preview() / "object.json",
      picture.statistics.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace

Result<ObjectView> draw_object(JobContext& job,
                               const config::SessionConfig& config,
                               const gpu::ContextOptions& gpu,
                               const std::function<void(double share)>& step) {
  ObjectView view;
  if (auto written = write_object_scene(job.files, job.session, config); !written)
    return written.error();
  auto scene = config::load_scene(object_scene_file(job.session));
  Result<Drawn> picture = scene ? drawn(*scene, config.reconstruction.threads, gpu, step, job.stop)
                                : Result<Drawn>(scene.error());
  if (!picture && picture.error().code == ErrorCode::kCancelled) return picture.error();
  if (!picture) {
    view.absent = picture.error().message;
    log::warning("no picture of an object of the material: {}", view.absent);
    return view;
  }
  picture->statistics["white"] = white_of(picture->radiance, scene->picture);
  picture->statistics["drawn_by"] = picture->by;
  if (auto written = write_pictures(job, *picture, *scene); !written) return written.error();
  view.picture = displayed(picture->radiance, picture->statistics["white"], scene->picture);
  view.statistics = std::move(picture->statistics);
  view.drawn_by = std::move(picture->by);
  return view;
}

}  // namespace opaline::daemon
