#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "base/image.h"
#include "render/raster/raster_renderer.h"
#include "render/scene/scene_renderer.h"

namespace opaline::daemon {

/// What draws a lit scene: rays on the processor, or Vulkan's rasteriser.
enum class DrawBy : std::uint8_t {
  kAuto,  ///< Vulkan on a device that is not a processor, rays where there is none or it is lost
  kHost,
  kVulkan,  ///< on any device
};

/// A scene that is made ready once, then lit and drawn as often as wanted.
///
/// Threads: one call at a time. Errors: those of SceneRenderer, and, with kVulkan, of RasterRenderer.
class SceneView {
 public:
  /// The team must outlive it. `device`: part of the name of the Vulkan device; empty: the best.
  static Result<std::unique_ptr<SceneView>> create(const render::Scene& scene,
                                                   DrawBy draw,
                                                   const gpu::ContextOptions& gpu,
                                                   ThreadTeam& team,
                                                   const render::SceneRenderer::Step& step,
                                                   std::stop_token stop);

  /// Linear radiance and coverage of the scene as it is now, under these lights. While a hand moves things, diffuse light may
  /// be as Subsurface::light() says.
  Result<Image<float>> picture(const std::vector<render::LightOptions>& lights,
                               const render::CameraOptions& camera,
                               render::Pace pace,
                               std::stop_token stop);
  Result<Image<float>> picture(const std::vector<render::LightOptions>& lights,
                               const render::CameraOptions& camera,
                               std::stop_token stop) {
    return picture(lights, camera, render::Pace::kAtRest, std::move(stop));
  }

  render::SceneRenderer& renderer() { return *renderer_; }
  const render::Scene& scene() const { return scene_; }
  std::string description() const;  ///< of what draws, for people

 private:
  SceneView(const render::Scene& scene, DrawBy draw) : scene_(scene), draw_(draw) {}
  Result<Image<float>> drawn(const CameraModel& camera, const std::stop_token& stop);
  Result<Image<float>> rasterised(const CameraModel& camera, const std::stop_token& stop);

  render::Scene scene_;
  DrawBy draw_;
  std::unique_ptr<render::SceneRenderer> renderer_;
  std::unique_ptr<render::RasterRenderer> raster_;  // none: rays draw
};

}  // namespace opaline::daemon
