// What changes while the exposures of one light are taken: named, taken again, and never measured by.

#include <gmock/gmock.h>

#include "base/io/dataset_io.h"
#include "capture/patterns.h"
#include "capture/sequence.h"
#include "tests/support/sequence_run.h"

namespace opaline::capture {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Every light at five exposures, so that each has others to be compared with.
class UnsteadySequence : public SequenceTest {
 protected:
  UnsteadySequence() { task_.options.exposures.mode = ExposureMode::kFixed; }
  /// One light is taken again for it, which is named in the events.
  nlohmann::json expect_named(sim::Faults faults, const std::string& kind) {
    expect_one_retake(std::move(faults), kind);
    const auto unsteady = events_->facts("region.unsteady");
    if (unsteady.size() != 1) {
      ADD_FAILURE() << unsteady.size() << " facts";
      return {};
    }
    EXPECT_EQ(unsteady[0]["kind"], kind) << unsteady[0].dump();
    EXPECT_TRUE(events_->facts("region.unusable").empty());
    return unsteady[0];
  }
  Files steady_results() {
    const testing::TemporaryDirectory steady;
    options_.faults = {};
    EXPECT_TRUE(run(steady.path()));
    EXPECT_TRUE(events_->facts("region.unsteady").empty());
    return results_of(steady.path());
  }
};

TEST_F(UnsteadySequence, TakesALightWithAFlickerAgain) {
  const auto fact = expect_named({{sim::FaultKind::kFlicker, kFirstLight + 2, 1}}, "flicker");
  EXPECT_EQ(fact["region"], "region_1_0");
  EXPECT_NEAR(fact["size"].get<double>(), 0.03, 0.005);
  EXPECT_TRUE(results_of(dir_.path()) == steady_results());
}

TEST_F(UnsteadySequence, TakesALightWithAShadowAgain) {
  const auto fact = expect_named({{sim::FaultKind::kShadow, kFirstLight + 3, 2}}, "motion");
  EXPECT_TRUE(fact.contains("x") && fact.contains("y")) << fact.dump();
  EXPECT_TRUE(results_of(dir_.path()) == steady_results());
}

TEST_F(UnsteadySequence, TakesALightAgainWhileTheLampFades) {
  const auto fact = expect_named({{sim::FaultKind::kFadingLamp, kFirstLight + 3, 1, 4}}, "drift");
  EXPECT_THAT(fact["message"].get<std::string>(), HasSubstr("light fell by"));
}

// One knock, and all lights before are of a sample that lay elsewhere.
TEST_F(UnsteadySequence, StopsWhereTheSampleHasMovedForGood) {
  options_.faults = {{sim::FaultKind::kMovedSample, kFirstLight + 3, 2}};
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message, AllOf(HasSubstr("region_1_1"), HasSubstr("Put it back")));
  const auto unsteady = events_->facts("region.unsteady");
  ASSERT_EQ(unsteady.size(), 1u);
  EXPECT_EQ(unsteady[0]["kind"], "motion");
  const auto moved = events_->facts("sample.moved");
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_NEAR(moved[0]["shift_px"].get<double>(), 1.5, 0.4);
  EXPECT_FALSE(lamp_on_);
  options_.faults = {};  // put back
  const auto again = run(dir_.path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 8);
  EXPECT_TRUE(results_of(dir_.path()) == steady_results());
}

TEST_F(UnsteadySequence, LeavesALightOutThatNeverIsSteady) {
  options_.faults = {{sim::FaultKind::kShadow, kFirstLight + 1, 1, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1}};
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(summary->unusable, ElementsAre("region_0_1"));
  EXPECT_EQ(events_->facts("region.unsteady").size(), 4u);
  EXPECT_EQ(events_->facts("region.retaken").size(), 3u);
  const auto unusable = events_->facts("region.unusable");
  ASSERT_EQ(unusable.size(), 1u);
  EXPECT_THAT(unusable[0]["message"].get<std::string>(),
              AllOf(HasSubstr("do not agree, 4 times"), HasSubstr("motion")));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set);
  EXPECT_EQ(set->illuminations[1].mask, Image<std::uint8_t>(8, 8, 1, 0));
  EXPECT_NE(set->illuminations[0].mask, Image<std::uint8_t>(8, 8, 1, 0));
  EXPECT_FALSE(lamp_on_);
}

TEST_F(UnsteadySequence, TakesALightThatNeverWasSteadyAgainWhenItIsRunOnceMore) {
  options_.faults = {{sim::FaultKind::kShadow, kFirstLight + 1, 1, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1},
                     {sim::FaultKind::kShadow, kFirstLight + 1, 4, 1}};
  ASSERT_TRUE(run(dir_.path()));
  options_.faults = {};
  const auto again = run(dir_.path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 1);
  EXPECT_TRUE(again->unusable.empty());
  EXPECT_TRUE(results_of(dir_.path()) == steady_results());
}

TEST_F(UnsteadySequence, StopsWhereTheLampFlickersOnAndOn) {
  task_.options.usable_share = 0.9;
  options_.faults = {{sim::FaultKind::kFlicker, 0, 0, 100'000}};
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message,
              AllOf(HasSubstr("regions cannot be used"), HasSubstr("do not agree, 4 times")));
  EXPECT_FALSE(lamp_on_);
}

// Believed times that are a tenth off are no flicker: said once, as the calibration's error.
TEST_F(UnsteadySequence, SaysOnceThatExposureTimesAreOff) {
  options_.faults = {{sim::FaultKind::kUnreportedExposure, 0, 0, 100'000}};
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->retaken, 2);
  const auto warnings = events_->facts("calibration.warning");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0]["message"].get<std::string>(), HasSubstr("the same each time"));
  EXPECT_TRUE(summary->unusable.empty());
}

TEST_F(UnsteadySequence, LooksAtBracketsAndPlannedExposuresToo) {
  for (const ExposureMode mode : {ExposureMode::kBracket, ExposureMode::kPlanned}) {
    task_.options.exposures.mode = mode;
    options_.faults = {};
    const testing::TemporaryDirectory steady;
    ASSERT_TRUE(run(steady.path()));
    EXPECT_EQ(events_->facts("region.unsteady").size(), 0u);
    const testing::TemporaryDirectory shadowed;
    options_.faults = {{sim::FaultKind::kShadow, kFirstLight + 3, 1}};
    ASSERT_TRUE(run(shadowed.path()));
    EXPECT_EQ(events_->facts("region.unsteady").size(), 1u);
    EXPECT_TRUE(results_of(shadowed.path()) == results_of(steady.path()));
  }
}

}  // namespace
}  // namespace opaline::capture
