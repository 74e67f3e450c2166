#include "capture/sequence.h"

#include <gmock/gmock.h>

#include "base/io/dataset_io.h"
#include "tests/support/sequence_run.h"

namespace opaline::capture {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

TEST_F(SequenceTest, PlansExposuresThatTakeLessTimeThanAllOfThem) {
  const auto exposed_in = [&](ExposureMode mode, const std::string& name) {
    task_.options.exposures.mode = mode;
    const auto summary = run(dir_.path() / name);
    EXPECT_TRUE(summary) << summary.error().message;
    double sum = 0.0;
    for (const auto& fact : events_->facts("region.captured"))
      sum += fact["exposed_s"].get<double>();
    return sum;
  };
  const double planned = exposed_in(ExposureMode::kPlanned, "planned");
  const double fixed = exposed_in(ExposureMode::kFixed, "fixed");
  EXPECT_NEAR(fixed, 11 * 325.0 / 30.0, 1e-3);  // 1, 4, 16, 64 and 240 turns
  EXPECT_LT(planned, 0.5 * fixed);
  const auto set = read_dataset(dir_.path() / "planned");
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->illuminations.size(), 11u);
}

TEST_F(SequenceTest, GoesOnWithPlannedExposuresWhereItWasStopped) {
  task_.options.exposures.mode = ExposureMode::kPlanned;
  ASSERT_TRUE(run(dir_.path() / "whole"));
  ASSERT_TRUE(run(dir_.path() / "stopped"));
  fs::remove_all(dir_.path() / "stopped" / "frames" / "region_1_0");
  const auto summary = run(dir_.path() / "stopped");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->taken, 1);
  EXPECT_EQ(results_of(dir_.path() / "stopped"), results_of(dir_.path() / "whole"));
}

TEST_F(SequenceTest, TellsTheBlackOfPlannedExposuresByWhiteLightAlsoWhenItGoesOn) {
  task_.options.exposures.mode = ExposureMode::kPlanned;
  ASSERT_TRUE(run(dir_.path() / "whole"));
  const auto facts = events_->facts("capture.black");
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_TRUE(facts[0]["told_by_white"]) << facts[0].dump();
  ASSERT_TRUE(run(dir_.path() / "stopped"));
  fs::resize_file(dir_.path() / "stopped" / "frames" / "white" / "00-33ms.png", 100);
  fs::remove_all(dir_.path() / "stopped" / "frames" / "region_1_0");
  const auto summary = run(dir_.path() / "stopped");
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(events_->facts("region.damaged")[0]["message"], HasSubstr("white"));
  EXPECT_EQ(results_of(dir_.path() / "stopped"), results_of(dir_.path() / "whole"));
}

TEST_F(SequenceTest, TakesMoreBlackFramesWhereWhiteClips) {
  options_.projector.peak_irradiance = {1e-2, 1e-2, 1e-2};
  task_ = support::tiny_task(options_);
  task_.options.exposures.mode = ExposureMode::kPlanned;
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  const auto facts = events_->facts("capture.black");
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_FALSE(facts[0]["told_by_white"]);
  EXPECT_GT(facts[0]["frames"], 8);
  EXPECT_FALSE(fs::exists(dir_.path() / "frames" / "white"));
}

}  // namespace
}  // namespace opaline::capture
