#include "render/view/background_light.h"

#include <utility>

#include "base/ensure.h"

namespace opaline::render {

void BackgroundLight::start(SceneRenderer& scene, std::vector<LightOptions> lights, Pace pace) {
  ENSURE(!busy());
  done_ = false;
  problem_.reset();
  thread_ = std::jthread([this, &scene, pace, own = std::move(lights)](std::stop_token stop) {
    if (auto lit = scene.light(own, pace, std::move(stop)); !lit) problem_ = lit.error();
    done_ = true;
  });
}

Result<void> BackgroundLight::take() {
  ENSURE(busy());
  thread_.join();
  if (problem_) return *std::exchange(problem_, std::nullopt);
  return ok();
}

bool BackgroundLight::stop() {
  if (!busy()) return false;
  thread_.request_stop();
  thread_.join();
  problem_.reset();
  return true;
}

}  // namespace opaline::render
