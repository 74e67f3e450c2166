#pragma once

#include <cstdint>
#include <mutex>
#include <stop_token>

#include "drivers/camera.h"
#include "sim/rig_port.h"

namespace opaline::sim {

/// The simulated station's camera: drivers::Camera over a RigPort, which outlives it.
class SimCamera : public drivers::Camera {
 public:
  explicit SimCamera(RigPort& rig) : rig_(rig) {}
  ~SimCamera() override { close_session(); }

  Result<void> open() override;
  Result<drivers::CameraInfo> info() const override;
  Result<Frame> capture(const drivers::ExposureRequest& request, std::stop_token stop) override;
  void close() noexcept override { close_session(); }

 private:
  void close_session() noexcept;

  RigPort& rig_;
  mutable std::mutex mutex_;
  std::uint64_t session_ = 0;  // guarded by mutex_; 0: closed
  drivers::CameraInfo info_;   // guarded by mutex_
  std::stop_source closing_;   // guarded by mutex_; ends the capture of this opening
};

}  // namespace opaline::sim
