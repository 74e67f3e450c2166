#include "capture/sequence.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/io/dataset_io.h"
#include "capture/patterns.h"
#include "tests/support/sequence_run.h"

namespace opaline::capture {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(SequenceTest, MasksARegionThatIsBlackWhileTheLampWorks) {
  options_.faults = {{sim::FaultKind::kBlackFrame, kFirstLight + 1, 0, 1000}};
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(summary->unusable, ElementsAre("region_0_1"));
  const auto unusable = events_->facts("region.unusable");
  ASSERT_EQ(unusable.size(), 1u);
  EXPECT_THAT(unusable[0]["message"].get<std::string>(), HasSubstr("the lamp works"));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set);
  EXPECT_EQ(set->illuminations[1].mask, Image<std::uint8_t>(8, 8, 1, 0));
}

TEST_F(SequenceTest, StopsWhenTheLampIsDeadAndGoesOnAtThatRegion) {
  options_.faults = {{sim::FaultKind::kBlackFrame, kFirstLight + 1, 0, 1000},
                     {sim::FaultKind::kBlackFrame, kWhitePattern, 0, 1000}};
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message, AllOf(HasSubstr("region_0_1"), HasSubstr("lamp")));
  options_.faults = {};
  const auto again = run(dir_.path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 10);
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

/// One pixel in a hundred is hot: it saturates in the longest exposure, whatever the lamp does.
class HotSequenceTest : public SequenceTest {
 protected:
  HotSequenceTest() { options_.camera.hot_pixel_fraction = 0.01; }
};

TEST_F(HotSequenceTest, MasksARegionThatIsBlackWhileTheLampWorks) {
  options_.faults = {{sim::FaultKind::kBlackFrame, kFirstLight + 1, 0, 1000}};
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(summary->unusable, ElementsAre("region_0_1"));
  const auto again = run(dir_.path());  // from the frames on disk
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_THAT(again->unusable, ElementsAre("region_0_1"));
}

TEST_F(HotSequenceTest, StopsWhenTheLampIsDead) {
  options_.faults = {{sim::FaultKind::kBlackFrame, 0, 0, 1000}};
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message, AllOf(HasSubstr("region_0_0"), HasSubstr("lamp")));
}

TEST_F(HotSequenceTest, RetakesTheRegionWhoseLongestExposureIsBlack) {
  task_.options.exposures.wanted_snr = 1e9;  // up to the longest
  const testing::TemporaryDirectory undisturbed;
  ASSERT_TRUE(run(undisturbed.path()));
  const int exposures = events_->facts("region.captured")[3]["exposures"];
  expect_one_retake({{sim::FaultKind::kBlackFrame, kFirstLight + 3, exposures - 1}}, "black");
  EXPECT_EQ(results_of(dir_.path()), results_of(undisturbed.path()));
}

TEST_F(SequenceTest, StopsWhenTooManyRegionsAreSaturatedAndSaysWhatWouldHelp) {
  options_.camera.sensitivity = {1e13, 1e13, 1e13};
  task_ = support::tiny_task(options_);
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message,
              AllOf(HasSubstr("3 of 4 regions"), HasSubstr("saturated"), HasSubstr("aperture")));
  EXPECT_EQ(events_->facts("region.unusable").size(), 3u);
}

// The projector's light falls off from the middle of its picture, which lies over region_1_1. Of this
// region the dimmest cell is made to clip in the shortest exposure, and only just.
TEST_F(SequenceTest, MasksARegionThatIsAllSaturatedAndGoesOn) {
  options_.projector.offset_x_px = 0.0;
  options_.projector.offset_y_px = 0.0;
  options_.projector.vignetting = {-1.8, 0.85, 0.0};
  options_.projector.black_level = 0.0;
  task_ = support::tiny_task(options_);
  const testing::TemporaryDirectory dim;
  ASSERT_TRUE(run(dim.path()));
  const auto all = read_dataset(dim.path());
  ASSERT_TRUE(all);
  double dimmest = 1e9;
  for (std::size_t i = 0; i < 64; ++i) {
    dimmest = std::min<double>(dimmest, all->illuminations[3].radiance.samples()[3 * i]);
  }
  const double clipping = task_.calibration.camera.full_scale_electrons();
  options_.camera.sensitivity.fill(1.15 * clipping / (dimmest / 30.0));
  task_ = support::tiny_task(options_);
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_THAT(summary->unusable, Contains("region_1_1"));
  const auto unusable = events_->facts("region.unusable");
  ASSERT_FALSE(unusable.empty());
  EXPECT_THAT(unusable[0]["message"].get<std::string>(), HasSubstr("saturated even at"));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set);
  EXPECT_EQ(set->illuminations[3].mask, Image<std::uint8_t>(8, 8, 1, 0));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NE(set->illuminations[i].mask, Image<std::uint8_t>(8, 8, 1, 0)) << i;
  }
}

TEST_F(SequenceTest, TellsTooFewPixelsFromSaturatedOnes) {
  for (int y = 0; y < 64; y += 4) {  // one at least in every cell of 5 x 5 pixels
    for (int x = 0; x < 64; x += 4) task_.calibration.camera.hot_pixels.emplace_back(x, y);
  }
  task_.options.min_coverage = 1.0;
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message,
              AllOf(HasSubstr("3 of 4 regions"),
                    HasSubstr("min_coverage"),
                    HasSubstr("100 % of its area"),
                    HasSubstr("(0 of the")));
}

TEST_F(SequenceTest, SeesThatPixelsAreFullBelowTheHighestCode) {
  options_.camera.sensitivity = {1e13, 1e13, 1e13};
  options_.camera.full_well_electrons = 5000.0;  // half the codes
  task_ = support::tiny_task(options_);
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, AllOf(HasSubstr("3 of 4 regions"), HasSubstr("saturated")));
}

}  // namespace
}  // namespace opaline::capture
