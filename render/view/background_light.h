#pragma once

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "render/scene/scene_renderer.h"

namespace opaline::render {

/// Lights a scene on a thread of its own, so that whoever shows it goes on.
///
///   idle -start()-> busy -(the light is found)-> ready -take()-> idle
///                     `-stop()-> idle: the light may be partly found
///
/// Nobody else may touch the scene between start() and take() or stop(), but to read its surfaces.
/// Threads: all calls from one.
class BackgroundLight {
 public:
  ~BackgroundLight() { stop(); }
  bool busy() const { return thread_.joinable(); }
  bool ready() const { return busy() && done_; }
  /// Needs to be idle.
  void start(SceneRenderer& scene, std::vector<LightOptions> lights, Pace pace);
  /// Waits for the light. Errors: those of SceneRenderer::light().
  Result<void> take();
  /// Stops it and waits for that: about as long as one iteration of the solver takes. True: there was something to stop.
  bool stop();

 private:
  std::atomic<bool> done_{false};
  std::optional<Error> problem_;
  std::jthread thread_;
};

}  // namespace opaline::render
