#include "daemon/render/scene_view.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "base/log.h"

namespace opaline::daemon {

Result<std::unique_ptr<SceneView>> SceneView::create(const render::Scene& scene,
                                                     DrawBy draw,
                                                     const gpu::ContextOptions& gpu,
                                                     ThreadTeam& team,
                                                     const render::SceneRenderer::Step& step,
                                                     std::stop_token stop) {
  std::unique_ptr<SceneView> view(new SceneView(scene, draw));
  auto renderer = render::SceneRenderer::create(scene, team, step, std::move(stop));
  if (!renderer) return renderer.error();
  view->renderer_ = *std::move(renderer);
  if (draw == DrawBy::kHost) return view;
  render::RasterOptions options;
  options.gpu = gpu;
  options.gpu.device.allow_software = draw == DrawBy::kVulkan && gpu.device.allow_software;
  auto raster = render::RasterRenderer::create(options);
  if (raster) {
    view->raster_ = *std::move(raster);
    view->renderer_->leave_out_single_scattering();
  } else if (draw == DrawBy::kVulkan || raster.error().code != ErrorCode::kUnavailable) {
    return raster.error();
  }
  return view;
}

Result<Image<float>> SceneView::picture(const std::vector<render::LightOptions>& lights,
                                        const render::CameraOptions& camera,
                                        render::Pace pace,
                                        std::stop_token stop) {
  if (auto lit = renderer_->light(lights, pace, stop); !lit) return lit.error();
  return drawn(render::camera_of(camera, scene_.picture), stop);
}

Result<Image<float>> SceneView::drawn(const CameraModel& camera, const std::stop_token& stop) {
  if (raster_) {
    auto picture = rasterised(camera, stop);
    const bool lost = !picture && picture.error().code == ErrorCode::kUnavailable;
    if (!lost || draw_ == DrawBy::kVulkan) return picture;
    log::warning("{}: rays draw from now on", picture.error().message);
    raster_.reset();
  }
  return renderer_->draw(camera, stop);
}

Result<Image<float>> SceneView::rasterised(const CameraModel& camera, const std::stop_token& stop) {
  const auto start = std::chrono::steady_clock::now();
  if (auto taken = raster_->take(*renderer_); !taken) return taken.error();
  for (const std::string& what : raster_->left_out()) renderer_->leave_out(what);
  auto picture = raster_->draw(camera, scene_.picture.samples_per_axis, stop);
  renderer_->took(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return picture;
}

std::string SceneView::description() const {
  return raster_ ? raster_->description() : "rays on the processor";
}

}  // namespace opaline::daemon
