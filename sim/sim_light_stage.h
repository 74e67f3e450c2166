#pragma once

#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "drivers/light_stage.h"
#include "sim/rig_port.h"

namespace opaline::sim {

/// The simulated station's light stage: drivers::LightStage over a RigPort whose light path is a LedSphere, and which outlives it. blank() works
/// also while closed, and then ends the session of whoever has the device, as a guardian wants. The lights stay as they are when this
/// process dies without close().
class SimLightStage : public drivers::LightStage {
 public:
  /// `lights` are what is believed of them.
  SimLightStage(RigPort& rig, std::vector<SphereLight> lights)
      : rig_(rig), lights_(std::move(lights)) {}
  ~SimLightStage() override { close_session(); }

  Result<void> open() override;
  Result<drivers::LightStageInfo> info() const override;
  Result<void> set(const drivers::StagePattern& pattern, std::stop_token stop) override;
  Result<void> blank() override;
  void close() noexcept override { close_session(); }

 private:
  void close_session() noexcept;

  RigPort& rig_;
  std::vector<SphereLight> lights_;
  mutable std::mutex mutex_;
  std::uint64_t session_ = 0;     // guarded by mutex_; 0: closed
  drivers::LightStageInfo info_;  // guarded by mutex_
};

}  // namespace opaline::sim
