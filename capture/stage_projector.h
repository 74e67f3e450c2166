#pragma once

#include "drivers/light_stage.h"
#include "drivers/projector.h"

namespace opaline::capture {

/// A light stage as the projector of its pictures (drivers/stage_picture.h), so that what takes a projector's patterns takes a stage's: proof of
/// pattern, retries, HDR, resuming. As LightStage for threads, waits and errors; the stage must outlive it.
class StageProjector : public drivers::Projector {
 public:
  explicit StageProjector(drivers::LightStage& stage) : stage_(stage) {}

  Result<void> open() override { return stage_.open(); }
  Result<drivers::ProjectorInfo> info() const override;
  Result<void> show(const drivers::Pattern& pattern, std::stop_token stop) override;
  Result<void> dark() override { return stage_.blank(); }
  void close() noexcept override { stage_.close(); }

 private:
  drivers::LightStage& stage_;
};

}  // namespace opaline::capture
