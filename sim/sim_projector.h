#pragma once

#include <cstdint>
#include <mutex>

#include "drivers/projector.h"
#include "sim/rig_port.h"

namespace opaline::sim {

/// The simulated station's projector: drivers::Projector over a RigPort, which outlives it. dark()
/// works also while closed, and then ends the session of whoever has the device, as a guardian wants. The lamp stays as it is when this process dies without close().
class SimProjector : public drivers::Projector {
 public:
  explicit SimProjector(RigPort& rig) : rig_(rig) {}
  ~SimProjector() override { close_session(); }

  Result<void> open() override;
  Result<drivers::ProjectorInfo> info() const override;
  Result<void> show(const drivers::Pattern& pattern, std::stop_token stop) override;
  Result<void> dark() override { return rig_.dark(session()); }
  void close() noexcept override { close_session(); }

 private:
  std::uint64_t session() const {
    const std::lock_guard lock(mutex_);
    return session_;
  }
  void close_session() noexcept;

  RigPort& rig_;
  mutable std::mutex mutex_;
  std::uint64_t session_ = 0;    // guarded by mutex_; 0: closed
  drivers::ProjectorInfo info_;  // guarded by mutex_
};

}  // namespace opaline::sim
