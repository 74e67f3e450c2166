// What drivers/camera.h and drivers/projector.h promise, held against every driver.

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "tests/conformance/device_bench.h"

namespace opaline::conformance {
namespace {

using namespace std::chrono_literals;
using drivers::Pattern;
using std::chrono::steady_clock;

constexpr std::chrono::nanoseconds kShort = 100ms;

class DeviceConformance : public ::testing::TestWithParam<Driver> {
 protected:
  void open() {
    const auto camera = bench_->camera().open();
    ASSERT_TRUE(camera) << camera.error().message;
    const auto projector = bench_->projector().open();
    ASSERT_TRUE(projector) << projector.error().message;
  }
  Pattern pattern(std::uint64_t id) {
    const auto info = bench_->projector().info();
    return {id, Image<std::uint8_t>(info->width, info->height, 3, 200)};
  }
  /// Shows a pattern and waits until its light must have followed.
  void show(std::uint64_t id) {
    const auto shown = bench_->projector().show(pattern(id), {});
    ASSERT_TRUE(shown) << shown.error().message;
    if (bench_->keeps_time()) std::this_thread::sleep_for(bench_->projector().info()->latency);
  }
  Result<Frame> take(std::uint64_t pattern_id,
                     std::chrono::nanoseconds exposure = kShort,
                     std::stop_token stop = {}) {
    return bench_->camera().capture({exposure, pattern_id}, std::move(stop));
  }
  ErrorCode code(const Result<Frame>& frame) {
    return frame ? ErrorCode::kInternal : frame.error().code;
  }

  std::unique_ptr<DeviceBench> bench_ = GetParam().make();
};

TEST_P(DeviceConformance, RefusesWhileClosed) {
  EXPECT_EQ(bench_->camera().info().error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(code(take(1)), ErrorCode::kUnavailable);
  EXPECT_EQ(bench_->projector().info().error().code, ErrorCode::kUnavailable);
  const Pattern any{1, Image<std::uint8_t>(80, 60, 3)};
  EXPECT_EQ(bench_->projector().show(any, {}).error().code, ErrorCode::kUnavailable);
  bench_->camera().close();  // closing what is closed is fine
  bench_->projector().close();
}

TEST_P(DeviceConformance, ReopensAfterCloseAndCountsFromOneAgain) {
  for (int round = 0; round < 2; ++round) {
    open();
    show(1);
    const auto frame = take(1);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->trigger_count, 1u);
    bench_->camera().close();
    bench_->projector().close();
    EXPECT_EQ(code(take(1)), ErrorCode::kUnavailable);
  }
}

TEST_P(DeviceConformance, SaysWhatItIs) {
  open();
  const auto camera = bench_->camera().info();
  ASSERT_TRUE(camera);
  EXPECT_FALSE(camera->model.empty());
  EXPECT_GT(camera->width, 0);
  EXPECT_GT(camera->height, 0);
  EXPECT_GE(camera->bit_depth, 8);
  EXPECT_LE(camera->bit_depth, 16);
  EXPECT_GT(camera->shortest_exposure, 0ns);
  EXPECT_LT(camera->shortest_exposure, camera->longest_exposure);
  const auto projector = bench_->projector().info();
  ASSERT_TRUE(projector);
  EXPECT_GT(projector->width, 0);
  EXPECT_GT(projector->frame_period, 0ns);
}

TEST_P(DeviceConformance, FramesProveWhatTheyShow) {
  open();
  std::uint64_t count = 0;
  std::chrono::nanoseconds last_start{-1};
  for (const std::uint64_t id : {1u, 2u, 3u}) {
    show(id);
    const auto frame = take(id);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->pattern_id, id);
    EXPECT_EQ(frame->trigger_count, ++count);
    EXPECT_GT(frame->start, last_start);
    EXPECT_EQ(frame->sha256, frame_hash(frame->pixels));
    EXPECT_EQ(frame->pixels.channels(), 3);
    EXPECT_EQ(frame->pixels.width(), bench_->camera().info()->width);
    EXPECT_EQ(frame->pixels.height(), bench_->camera().info()->height);
    EXPECT_NEAR(static_cast<double>(frame->exposure.count()), 1e8, 1e6);
    for (const std::uint16_t sample : frame->pixels.samples())
      EXPECT_LT(sample, 1 << frame->bit_depth);
    last_start = frame->start;
  }
}

TEST_P(DeviceConformance, TheSameRequestGivesTheSamePixels) {
  open();
  show(2);
  const auto first = take(2);
  const auto second = take(2);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->sha256, second->sha256);
}

TEST_P(DeviceConformance, ExposuresOutOfRangeAreInvalid) {
  open();
  show(1);
  const auto info = bench_->camera().info();
  for (const auto exposure : {info->shortest_exposure - 1ns,
                              info->longest_exposure + 1ns,
                              std::chrono::nanoseconds(0),
                              std::chrono::nanoseconds(-1)}) {
    EXPECT_EQ(code(take(1, exposure)), ErrorCode::kInvalidArgument) << exposure.count();
  }
  EXPECT_TRUE(take(1));  // and it still works
}

TEST_P(DeviceConformance, PatternsOfTheWrongSizeOrWithoutIdAreInvalid) {
  open();
  Pattern wrong = pattern(1);
  wrong.id = 0;
  EXPECT_EQ(bench_->projector().show(wrong, {}).error().code, ErrorCode::kInvalidArgument);
  const int width = bench_->projector().info()->width;
  const int height = bench_->projector().info()->height;
  for (const auto& codes : {Image<std::uint8_t>(width + 1, height, 3),
                            Image<std::uint8_t>(width, height, 1),
                            Image<std::uint8_t>()}) {
    EXPECT_EQ(bench_->projector().show({1, codes}, {}).error().code, ErrorCode::kInvalidArgument);
  }
  EXPECT_TRUE(bench_->projector().show(pattern(1), {}));
}

TEST_P(DeviceConformance, DoesNothingOnceStopped) {
  open();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(code(take(1, kShort, stop.get_token())), ErrorCode::kCancelled);
  EXPECT_EQ(bench_->projector().show(pattern(1), stop.get_token()).error().code,
            ErrorCode::kCancelled);
}

TEST_P(DeviceConformance, StopsWithin100MillisecondsWhenAsked) {
  if (!bench_->keeps_time()) GTEST_SKIP() << "an exposure is over at once";
  open();
  auto quickest = 10'000ms;
  for (int attempt = 0; attempt < 3 && quickest > 100ms; ++attempt) {  // the machine may be busy
    std::stop_source stop;
    steady_clock::time_point asked;
    std::jthread asking([&] {
      std::this_thread::sleep_for(20ms);
      asked = steady_clock::now();
      stop.request_stop();
    });
    EXPECT_EQ(code(take(0, 8s, stop.get_token())), ErrorCode::kCancelled);
    const auto stopped = steady_clock::now();
    asking.join();
    quickest = std::min(quickest, std::chrono::ceil<std::chrono::milliseconds>(stopped - asked));
  }
  EXPECT_LE(quickest, 100ms);
  EXPECT_TRUE(take(0));  // and it still works
}

TEST_P(DeviceConformance, ClosingFromAnotherThreadEndsACapture) {
  if (!bench_->keeps_time()) GTEST_SKIP() << "an exposure is over at once";
  open();
  std::jthread closing([&] {
    std::this_thread::sleep_for(20ms);
    bench_->camera().close();
  });
  EXPECT_EQ(code(take(0, 8s)), ErrorCode::kCancelled);
  closing.join();
  ASSERT_TRUE(bench_->camera().open());
  EXPECT_TRUE(take(0));
}

TEST_P(DeviceConformance, AnExposureTakesAsLongAsAskedForAndNotMuchLonger) {
  if (!bench_->keeps_time()) GTEST_SKIP() << "an exposure is over at once";
  open();
  const auto start = steady_clock::now();
  ASSERT_TRUE(take(0, kShort));
  const auto took = steady_clock::now() - start;
  EXPECT_GE(took, kShort * 99 / 100);
  EXPECT_LE(took, kShort * 3 / 2 + 2s);  // the deadline
}

TEST_P(DeviceConformance, AFrameThatNeverComesIsATimeout) {
  if (!bench_->keeps_time()) GTEST_SKIP() << "a frame comes at once or not at all";
  open();
  show(1);
  bench_->lose_frame();
  const auto start = steady_clock::now();
  EXPECT_EQ(code(take(1)), ErrorCode::kTimeout);
  const auto took = steady_clock::now() - start;
  EXPECT_GE(took, kShort);
  EXPECT_LE(took, kShort * 3 / 2 + 2s + 2s);  // the deadline, and a busy machine
  EXPECT_TRUE(take(1));                       // and it still works
}

TEST_P(DeviceConformance, ACameraLostWhileItExposesIsUnavailable) {
  if (!bench_->keeps_time()) GTEST_SKIP() << "an exposure is over at once";
  open();
  show(1);
  bench_->unplug_camera();
  const auto start = steady_clock::now();
  EXPECT_EQ(code(take(1, 400ms)), ErrorCode::kUnavailable);
  EXPECT_GE(steady_clock::now() - start, 190ms);  // half of it
  EXPECT_EQ(bench_->camera().info().error().code, ErrorCode::kUnavailable);
  bench_->plug();
  ASSERT_TRUE(bench_->camera().open());
  EXPECT_TRUE(take(1));
}

TEST_P(DeviceConformance, ShowReturnsWithin100MillisecondsOfAStopRequest) {
  open();
  auto quickest = 10'000ms;
  for (std::uint64_t attempt = 1; attempt <= 3 && quickest > 100ms; ++attempt) {  // a busy machine
    std::stop_source stop;
    steady_clock::time_point asked;
    std::jthread asking([&] {
      std::this_thread::sleep_for(1ms);
      asked = steady_clock::now();
      stop.request_stop();
    });
    const auto shown = bench_->projector().show(pattern(attempt), stop.get_token());
    const auto returned = steady_clock::now();
    asking.join();
    EXPECT_TRUE(shown || shown.error().code == ErrorCode::kCancelled);
    quickest = std::min(quickest, std::chrono::ceil<std::chrono::milliseconds>(returned - asked));
  }
  EXPECT_LE(quickest, 100ms);
  EXPECT_TRUE(bench_->projector().show(pattern(9), {}));  // and it still works
}

TEST_P(DeviceConformance, DarkComesFromAnyThreadWhileTheCameraExposes) {
  open();
  show(1);
  Result<void> darkened = ok();
  std::jthread darkening([&] {
    std::this_thread::sleep_for(20ms);
    darkened = bench_->projector().dark();
  });
  EXPECT_TRUE(take(1, kShort));
  darkening.join();
  EXPECT_TRUE(darkened);
  const auto frame = take(0);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->pattern_id, 0u);
  show(2);  // its own projector's dark does not end the session
  EXPECT_TRUE(take(2));
}

TEST_P(DeviceConformance, ALostCameraIsUnavailableUntilItIsBack) {
  open();
  show(1);
  ASSERT_TRUE(take(1));
  bench_->unplug_camera();
  EXPECT_EQ(code(take(1)), ErrorCode::kUnavailable);
  EXPECT_EQ(code(take(1)), ErrorCode::kUnavailable);  // closed now
  EXPECT_FALSE(bench_->camera().open());
  bench_->plug();
  ASSERT_TRUE(bench_->camera().open());
  const auto frame = take(1);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->trigger_count, 1u);
}

TEST_P(DeviceConformance, ALostProjectorIsUnavailableUntilItIsBack) {
  if (!bench_->can_unplug_projector()) GTEST_SKIP() << "there is none";
  open();
  const Pattern any = pattern(1);
  bench_->unplug_projector();
  EXPECT_EQ(bench_->projector().show(any, {}).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(bench_->projector().info().error().code, ErrorCode::kUnavailable);
  EXPECT_FALSE(bench_->projector().open());
  bench_->plug();
  ASSERT_TRUE(bench_->projector().open());
  EXPECT_TRUE(bench_->projector().show(any, {}));
}

TEST_P(DeviceConformance, DarkWorksWhateverTheProjectorDoes) {
  EXPECT_TRUE(bench_->projector().dark());
  open();
  show(1);
  EXPECT_TRUE(bench_->projector().dark());
  const auto frame = take(0);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->pattern_id, 0u);
}

INSTANTIATE_TEST_SUITE_P(Drivers,
                         DeviceConformance,
                         ::testing::Values(Driver{"sim", make_sim_bench},
                                           Driver{"sim_socket", make_socket_bench},
                                           Driver{"replay", make_replay_bench}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace opaline::conformance
