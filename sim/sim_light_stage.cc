#include "sim/sim_light_stage.h"

#include <fmt/format.h>

#include "drivers/stage_picture.h"

namespace opaline::sim {

Result<void> SimLightStage::open() {
  close_session();
  const auto opened = rig_.open_projector();
  if (!opened) return opened.error();
  const auto lights = static_cast<std::size_t>(opened->info.width - 1);
  if (opened->info.height != 1 || lights != lights_.size()) {
    rig_.close_projector(opened->session);
    return invalid_argument(
        fmt::format("the simulated stage has {} lights; expected {}", lights, lights_.size()));
  }
  const std::lock_guard lock(mutex_);
  session_ = opened->session;
  info_ = {"simulated sphere of lights",
           opened->info.serial,
           lights_,
           opened->info.frame_period,
           opened->info.latency,
           true};
  return ok();
}

Result<drivers::LightStageInfo> SimLightStage::info() const {
  const std::lock_guard lock(mutex_);
  if (session_ == 0) return unavailable("simulated light stage: not open");
  return info_;
}

Result<void> SimLightStage::set(const drivers::StagePattern& pattern, std::stop_token stop) {
  std::uint64_t opened = 0;
  {
    const std::lock_guard lock(mutex_);
    if (session_ == 0) return unavailable("simulated light stage: not open");
    if (auto good = check(pattern, info_); !good) return good;
    opened = session_;
  }
  Result<void> shown = rig_.show(opened, drivers::stage_picture(pattern), stop);
  if (!shown && shown.error().code == ErrorCode::kUnavailable) {
    const std::lock_guard lock(mutex_);
    if (session_ == opened) session_ = 0;
  }
  return shown;
}

Result<void> SimLightStage::blank() {
  const std::uint64_t session = [this] {
    const std::lock_guard lock(mutex_);
    return session_;
  }();
  return rig_.dark(session);
}

void SimLightStage::close_session() noexcept {
  std::uint64_t session = 0;
  {
    const std::lock_guard lock(mutex_);
    session = std::exchange(session_, 0);
  }
  if (session != 0) rig_.close_projector(session);
}

}  // namespace opaline::sim
