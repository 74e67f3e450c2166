// What drivers/light_stage.h promises, held against every driver.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/conformance/stage_bench.h"

namespace opaline::conformance {
namespace {

using namespace std::chrono_literals;
using drivers::StagePattern;
using std::chrono::steady_clock;

class StageConformance : public ::testing::TestWithParam<StageDriver> {
 protected:
  drivers::LightStage& stage() { return bench_->stage(); }
  void open() {
    const auto opened = stage().open();
    ASSERT_TRUE(opened) << opened.error().message;
  }
  StagePattern pattern(std::uint64_t id, std::uint8_t code = 100) {
    const auto info = stage().info();
    return {id, std::vector<std::uint8_t>(info ? info->lights.size() : 1, code)};
  }
  ErrorCode code(const Result<void>& done) {
    return done ? ErrorCode::kInternal : done.error().code;
  }
  std::unique_ptr<StageBench> bench_ = GetParam().make();
};

TEST_P(StageConformance, RefusesWhileClosed) {
  EXPECT_EQ(stage().info().error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(code(stage().set(pattern(1), {})), ErrorCode::kUnavailable);
  stage().close();  // closing what is closed is fine
}

TEST_P(StageConformance, SaysWhereItsLightsAre) {
  open();
  const auto info = stage().info();
  ASSERT_TRUE(info);
  EXPECT_FALSE(info->model.empty());
  ASSERT_FALSE(info->lights.empty());
  for (const SphereLight& light : info->lights) {
    EXPECT_GT(length(light.position), 0.0);
    EXPECT_GT(light.intensity, 0.0);
  }
  EXPECT_GT(info->period, 0ns);
}

TEST_P(StageConformance, IsDarkWhenOpenedAndClosedAndBlanked) {
  open();
  EXPECT_TRUE(bench_->is_dark());
  ASSERT_TRUE(stage().set(pattern(1), {}));
  EXPECT_FALSE(bench_->is_dark());
  ASSERT_TRUE(stage().blank());
  EXPECT_TRUE(bench_->is_dark());
  ASSERT_TRUE(stage().set(pattern(2), {}));  // its own blank does not end the session
  EXPECT_FALSE(bench_->is_dark());
  stage().close();
  EXPECT_TRUE(bench_->is_dark());
  EXPECT_EQ(code(stage().set(pattern(3), {})), ErrorCode::kUnavailable);
  open();
  ASSERT_TRUE(stage().set(pattern(4), {}));
  open();  // again, without a close
  EXPECT_TRUE(bench_->is_dark());
}

TEST_P(StageConformance, BlankWorksWhileClosed) {
  EXPECT_TRUE(stage().blank());
  EXPECT_TRUE(bench_->is_dark());
}

TEST_P(StageConformance, PatternsThatDoNotFitAreInvalid) {
  open();
  const auto info = *stage().info();
  EXPECT_EQ(code(stage().set(pattern(0), {})), ErrorCode::kInvalidArgument);
  StagePattern wrong = pattern(1);
  wrong.codes.pop_back();
  EXPECT_EQ(code(stage().set(wrong, {})), ErrorCode::kInvalidArgument);
  wrong = pattern(1);
  wrong.polarization = drivers::Polarization::kParallel;
  EXPECT_EQ(bool(stage().set(wrong, {})), info.turns_polarizer);
  EXPECT_TRUE(stage().set(pattern(2), {}));  // and it still works
}

TEST_P(StageConformance, DoesNothingOnceStopped) {
  open();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(code(stage().set(pattern(1), stop.get_token())), ErrorCode::kCancelled);
  EXPECT_TRUE(bench_->is_dark());
}

TEST_P(StageConformance, BlankFromAnotherThreadWinsOverAnySet) {
  open();
  for (std::uint64_t round = 1; round <= 20; ++round) {
    Result<void> blanked = ok();
    std::jthread blanking([&] { blanked = stage().blank(); });
    const auto set = stage().set(pattern(round), {});
    blanking.join();
    EXPECT_TRUE(blanked);
    EXPECT_TRUE(set || set.error().code == ErrorCode::kCancelled);
    EXPECT_TRUE(set || bench_->is_dark());
    ASSERT_TRUE(stage().blank());
  }
}

TEST_P(StageConformance, BlankTakesLessThanASecond) {
  open();
  ASSERT_TRUE(stage().set(pattern(1), {}));
  const auto start = steady_clock::now();
  ASSERT_TRUE(stage().blank());
  EXPECT_LT(steady_clock::now() - start, 1s);
}

TEST_P(StageConformance, ALostStageIsUnavailableUntilItIsBack) {
  open();
  const StagePattern any = pattern(1);
  bench_->unplug();
  EXPECT_EQ(code(stage().set(any, {})), ErrorCode::kUnavailable);
  EXPECT_EQ(stage().info().error().code, ErrorCode::kUnavailable);
  EXPECT_FALSE(stage().open());
  bench_->plug();
  open();
  EXPECT_TRUE(stage().set(any, {}));
}

INSTANTIATE_TEST_SUITE_P(Drivers,
                         StageConformance,
                         ::testing::Values(StageDriver{"udmx", make_udmx_bench},
                                           StageDriver{"sim", make_sim_stage_bench},
                                           StageDriver{"sim_socket", make_socket_stage_bench}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace opaline::conformance
