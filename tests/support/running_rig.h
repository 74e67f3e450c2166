#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/simulated_station.h"

namespace opaline::sim {

inline constexpr std::chrono::nanoseconds kTurn{33'333'333};

/// A tiny station with an opened camera and projector, on a clock that stands still unless somebody
/// waits.
class RigTest : public ::testing::Test {
 protected:
  void build(const RigOptions& options) {
    options_ = options;
    camera_.reset();
    projector_.reset();
    auto made = Rig::create(options, support::tiny_responses(), &clock_);
    ASSERT_TRUE(made) << made.error().message;
    rig_ = *std::move(made);
    camera_ = std::make_unique<SimCamera>(*rig_);
    projector_ = std::make_unique<SimProjector>(*rig_);
    ASSERT_TRUE(camera_->open());
    ASSERT_TRUE(projector_->open());
  }
  void SetUp() override { build(support::tiny_rig()); }

  void show(std::uint64_t id, std::uint8_t code) {
    ASSERT_TRUE(projector_->show(support::flat_pattern(options_, id, code), {}));
    clock_.sleep(options_.projector.latency, {});
  }
  Frame take(std::chrono::nanoseconds exposure) {
    Result<Frame> frame = camera_->capture({exposure, 0}, {});
    EXPECT_TRUE(frame) << frame.error().message;
    return frame ? *std::move(frame) : Frame{};
  }
  Result<Frame> try_take(std::chrono::nanoseconds exposure = kTurn) {
    return camera_->capture({exposure, 0}, {});
  }

  ManualClock clock_;
  RigOptions options_;
  std::unique_ptr<Rig> rig_;
  std::unique_ptr<SimCamera> camera_;
  std::unique_ptr<SimProjector> projector_;
};

/// Mean code above black of a channel over the middle of the picture.
inline double middle(const Frame& frame, int channel) {
  double sum = 0.0;
  for (int y = 20; y < 44; ++y) {
    for (int x = 20; x < 44; ++x) sum += frame.pixels.at(x, y, channel) - 64.0;
  }
  return sum / (24.0 * 24.0);
}

}  // namespace opaline::sim
