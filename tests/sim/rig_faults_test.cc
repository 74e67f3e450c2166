#include "sim/rig.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/support/running_rig.h"

namespace opaline::sim {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

class RigFaultTest : public RigTest {
 protected:
  void arm(FaultKind kind, int count = 1, int skip = 0) {
    ASSERT_TRUE(rig_->arm({{kind, 0, skip, count}}));
  }
};

TEST_F(RigFaultTest, AStaleFrameNamesTheOldPattern) {
  show(1, 0);
  show(2, 255);
  arm(FaultKind::kStaleFrame);
  const Frame stale = take(kTurn);
  EXPECT_EQ(stale.pattern_id, 1u);
  EXPECT_LT(middle(stale, 0), 5.0);
  EXPECT_EQ(take(kTurn).pattern_id, 2u);
}

TEST_F(RigFaultTest, ADuplicateFrameKeepsItsTriggerCount) {
  show(1, 0);
  const Frame first = take(kTurn);
  show(2, 255);
  arm(FaultKind::kDuplicateFrame);
  const Frame duplicate = take(kTurn);
  EXPECT_EQ(duplicate.trigger_count, first.trigger_count);
  EXPECT_EQ(duplicate.sha256, first.sha256);
  EXPECT_EQ(take(kTurn).trigger_count, 2u);
}

TEST_F(RigFaultTest, ATornFrameBreaksItsHash) {
  show(1, 255);
  arm(FaultKind::kTornFrame);
  const Frame torn = take(kTurn);
  EXPECT_NE(torn.sha256, frame_hash(torn.pixels));
  const Frame whole = take(kTurn);
  EXPECT_EQ(whole.sha256, frame_hash(whole.pixels));
}

TEST_F(RigFaultTest, ABlackFrameHasTheRightIdAndNoLight) {
  show(1, 255);
  arm(FaultKind::kBlackFrame);
  const Frame black = take(kTurn);
  EXPECT_EQ(black.pattern_id, 1u);
  EXPECT_LT(middle(black, 0), 1.0);
}

TEST_F(RigFaultTest, AMissingFrameTimesOutAndIsNotCounted) {
  show(1, 255);
  arm(FaultKind::kMissingFrame);
  const nanoseconds start = clock_.now();
  const auto missing = try_take(1s);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(clock_.now() - start, 3500ms);
  EXPECT_EQ(take(kTurn).trigger_count, 1u);
}

TEST_F(RigFaultTest, OtherFrameFaultsShowInTheFields) {
  show(1, 255);
  const Frame first = take(kTurn);
  arm(FaultKind::kSkippedTrigger);
  EXPECT_EQ(take(kTurn).trigger_count, 3u);
  arm(FaultKind::kTimeBackwards);
  EXPECT_LT(take(kTurn).start, first.start + 2 * kTurn - 1ms);
  arm(FaultKind::kWrongExposure);
  EXPECT_GT(take(kTurn).exposure, kTurn * 5 / 4);
}

TEST_F(RigFaultTest, FaultsWaitForTheirTurnAndEnd) {
  show(1, 255);
  arm(FaultKind::kTornFrame, 2, 1);
  const auto intact = [&] {
    const Frame frame = take(kTurn);
    return frame.sha256 == frame_hash(frame.pixels);
  };
  EXPECT_TRUE(intact());
  EXPECT_FALSE(intact());
  EXPECT_FALSE(intact());
  EXPECT_TRUE(intact());
}

TEST_F(RigFaultTest, FaultsAddedAtTheSameTimeAllCome) {
  const auto add_fifty = [&] {
    for (int i = 0; i < 50; ++i) EXPECT_TRUE(rig_->add({{.kind = FaultKind::kTornFrame}}));
  };
  std::jthread other(add_fifty);
  add_fifty();
  other.join();
  EXPECT_EQ(rig_->status()->faults.size(), 100u);
}

TEST_F(RigFaultTest, AFaultMayWaitForAPattern) {
  ASSERT_TRUE(rig_->arm({{.kind = FaultKind::kBlackFrame, .pattern = 2}}));
  show(1, 255);
  EXPECT_GT(middle(take(kTurn), 0), 50.0);
  show(2, 255);
  EXPECT_LT(middle(take(kTurn), 0), 1.0);
}

TEST_F(RigFaultTest, ALostCameraComesBackAfterAWhile) {
  arm(FaultKind::kCameraLost, 2);
  EXPECT_EQ(try_take().error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(try_take().error().code, ErrorCode::kUnavailable);  // closed
  EXPECT_EQ(camera_->open().error().code, ErrorCode::kUnavailable);
  ASSERT_TRUE(camera_->open());
  EXPECT_TRUE(try_take());
}

TEST_F(RigFaultTest, ALostProjectorComesBackAfterAWhile) {
  arm(FaultKind::kProjectorLost, 2);
  const drivers::Pattern pattern = support::flat_pattern(options_, 1, 255);
  EXPECT_EQ(projector_->show(pattern, {}).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(projector_->open().error().code, ErrorCode::kUnavailable);
  ASSERT_TRUE(projector_->open());
  EXPECT_TRUE(projector_->show(pattern, {}));
}

TEST_F(RigFaultTest, AStuckPatternAndASlowProjectorShowInTheId) {
  show(1, 255);
  arm(FaultKind::kPatternStuck);
  show(2, 255);
  EXPECT_EQ(take(kTurn).pattern_id, 1u);
  arm(FaultKind::kSlowProjector);
  show(3, 255);
  EXPECT_EQ(take(kTurn).pattern_id, 1u);
  clock_.advance(1s);
  EXPECT_EQ(take(kTurn).pattern_id, 3u);
}

TEST_F(RigFaultTest, AStuckLampStaysOnOnce) {
  show(1, 255);
  arm(FaultKind::kLampStuck);
  ASSERT_TRUE(projector_->dark());
  EXPECT_TRUE(rig_->status()->lamp_on);
  ASSERT_TRUE(projector_->dark());
  EXPECT_FALSE(rig_->status()->lamp_on);
}

/// With a projector picture so large that its light takes a while to work out: dark() and stop requests come meanwhile.
class LateShowTest : public RigTest {
 protected:
  void SetUp() override {
    options_ = support::tiny_rig();
    options_.projector.width = options_.projector.height = 2000;
    build(options_);
  }
  /// Shows patterns, none seen before, each overtaken by `interrupt` a moment after; until one show is ended by it.
  template <class Interrupt>
  Result<void> show_overtaken(Interrupt interrupt) {
    Result<void> shown = ok();
    for (std::uint8_t attempt = 1; attempt <= 50 && shown; ++attempt) {
      if (auto dark = projector_->dark(); !dark) return dark;
      std::atomic<bool> begun = false;
      std::stop_source stop;
      std::jthread showing([&] {
        const auto pattern = support::flat_pattern(options_, attempt, attempt);
        begun = true;
        shown = projector_->show(pattern, stop.get_token());
      });
      while (!begun) std::this_thread::yield();
      std::this_thread::sleep_for(2ms);
      interrupt(stop);
      showing.join();
    }
    clock_.sleep(options_.projector.latency, {});
    return shown;
  }
  bool lamp_on() { return rig_->status()->lamp_on; }
};

TEST_F(LateShowTest, DoesNotLightTheLampThatAnOutsiderMadeDark) {
  const auto shown =
      show_overtaken([&](std::stop_source&) { EXPECT_TRUE(rig_->dark(RigPort::kAnybody)); });
  ASSERT_FALSE(shown);
  EXPECT_EQ(shown.error().code, ErrorCode::kUnavailable);  // the session is over
  EXPECT_FALSE(lamp_on());
  EXPECT_FALSE(projector_->show(support::flat_pattern(options_, 99, 99), {}));
}

TEST_F(LateShowTest, IsOvertakenByItsOwnProjectorsDark) {
  const auto shown = show_overtaken([&](std::stop_source&) { EXPECT_TRUE(projector_->dark()); });
  ASSERT_FALSE(shown);
  EXPECT_EQ(shown.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(lamp_on());
  EXPECT_TRUE(projector_->show(support::flat_pattern(options_, 99, 99), {}));
}

TEST_F(LateShowTest, LightsNothingOnceStopped) {
  const auto shown = show_overtaken([](std::stop_source& stop) { stop.request_stop(); });
  ASSERT_FALSE(shown);
  EXPECT_EQ(shown.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(lamp_on());
}

TEST(FaultNames, GoThereAndBack) {
  for (const FaultName& fault : fault_names()) {
    EXPECT_EQ(to_string(fault.kind), fault.name);
    EXPECT_EQ(fault_from_name(fault.name).value(), fault.kind);
  }
  const auto unknown = fault_from_name("gremlin");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, ::testing::HasSubstr("stale_frame"));
}

}  // namespace
}  // namespace opaline::sim
