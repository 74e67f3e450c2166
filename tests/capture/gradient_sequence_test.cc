#include "capture/gradient_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/io/stage_record_io.h"
#include "capture/stage_projector.h"
#include "sim/sim_camera.h"
#include "sim/sim_light_stage.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"
#include "tests/support/tiny_sphere.h"

namespace opaline::capture {
namespace {

using support::RecordingSink;
using support::TinySphere;
using ::testing::HasSubstr;

std::shared_ptr<const sim::LightPath> traced_once(const TinySphere& tiny) {
  static const std::shared_ptr<const sim::LightPath> path = tiny.path();
  return path;
}

class GradientSequenceTest : public ::testing::Test {
 protected:
  GradientTask task() const {
    GradientTask task;
    task.camera = support::calibration_of(tiny_.rig).camera;
    task.lights = tiny_.lights;
    task.options.exposures.wanted_snr = 20.0;
    return task;
  }
  Result<GradientSummary> capture(const GradientTask& task, std::stop_token stop = {}) {
    const auto rig = tiny_.make_rig(traced_, &clock_);
    if (auto armed = rig->arm(faults_); !armed) return armed.error();
    sim::SimCamera camera(*rig);
    sim::SimLightStage stage(*rig, tiny_.lights);
    StageProjector projector(stage);
    auto done =
        capture_gradients(task,
                          {camera, projector, clock_},
                          {directory_.path(),
                           system_files(),
                           events_,
                           [this](const auto&) -> Result<std::uint64_t> { return free_bytes_; }},
                          std::move(stop));
    EXPECT_FALSE(rig->status()->lamp_on);
    return done;
  }
  auto results() { return support::files_below(directory_.path() / "hdr"); }

  TinySphere tiny_;
  std::shared_ptr<const sim::LightPath> traced_ = traced_once(tiny_);
  sim::Faults faults_;
  std::uint64_t free_bytes_ = 1'000'000'000;
  ManualClock clock_;
  RecordingSink events_;
  testing::TemporaryDirectory directory_;
};

TEST_F(GradientSequenceTest, TakesEveryPictureAndRecordsWhatItWas) {
  const auto done = capture(task());
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->pictures, 6);
  EXPECT_EQ(done->taken, 6);
  EXPECT_NEAR(done->drift, 0.0, 0.002);
  const auto record = read_stage_record(directory_.path());
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(record->lights, tiny_.lights);
  EXPECT_NEAR(record->pixel_mm, 0.4, 1e-9);
  EXPECT_NEAR(record->distance_mm, 1000.0, 1e-6);
  EXPECT_NEAR(length(record->middle), 0.0, 1e-9);
  EXPECT_NEAR(record->axes[1].y, -1.0, 1e-9);  // down the picture
  EXPECT_EQ(record->pictures[1].name, "gradient_x");
  EXPECT_EQ(results().size(), 6U);
}

TEST_F(GradientSequenceTest, ABeamIsPhotographedAloneAndInNoPattern) {
  tiny_.lights.push_back({{0.0, 0.0, 500.0}, 0.0});
  tiny_.rig.projector.width = static_cast<int>(tiny_.lights.size()) + 1;
  tiny_.sphere.beam = sim::LedBeam{{0.0, 0.0, 500.0}, {0.0, 0.0, 8.0}, 0.002, 20'000};
  traced_ = tiny_.path();
  GradientTask with_beam = task();
  with_beam.beam = true;
  const auto done = capture(with_beam);
  ASSERT_TRUE(done) << done.error().message;
  const auto record = read_stage_record(directory_.path());
  ASSERT_TRUE(record) << record.error().message;
  for (const StagePicture& picture : record->pictures) {
    const bool alone = picture.name == "beam";
    EXPECT_EQ(picture.codes.back(), alone ? 255 : 0) << picture.name;
    EXPECT_EQ(std::ranges::count(picture.codes, 0) == std::ssize(picture.codes) - 1, alone);
  }
  ASSERT_NE(record->find("beam"), nullptr);
  EXPECT_EQ(record->pictures.back().name, "constant_again");
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / "hdr" / "beam.exr"));
}

TEST_F(GradientSequenceTest, GoesOnWhereItWasStoppedWithTheSameResult) {
  ASSERT_TRUE(capture(task()));
  const auto whole = results();
  std::filesystem::remove_all(directory_.path() / "frames" / "gradient_y");
  std::filesystem::remove_all(directory_.path() / "hdr");
  std::filesystem::remove(directory_.path() / "light_stage.json");
  const auto again = capture(task());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 1);
  EXPECT_EQ(results(), whole);
}

TEST_F(GradientSequenceTest, ABadFrameIsNamedAndTakenAgain) {
  faults_ = {{.kind = sim::FaultKind::kTornFrame, .pattern = 17, .count = 1}};
  const auto done = capture(task());
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->retaken, 1);
  const auto facts = events_.facts("region.retaken");
  ASSERT_EQ(facts.size(), 1U);
  EXPECT_EQ(facts[0]["region"], "gradient_x");
  EXPECT_EQ(facts[0]["fault"], "torn");
}

TEST_F(GradientSequenceTest, OneThatStaysBadEndsItByName) {
  faults_ = {{.kind = sim::FaultKind::kWrongExposure, .pattern = 18, .count = 1000}};
  const auto done = capture(task());
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("gradient_y, taken 4 times"));
}

TEST_F(GradientSequenceTest, DriftIsMeasuredRecordedAndBeyondReasonRefused) {
  tiny_.rig.projector.drift_per_hour = 8.0;  // of simulated time: half a minute or so
  GradientTask slow = task();
  slow.gradient.drift_limit = 0.005;
  const auto done = capture(slow);
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_GT(done->drift, 0.005);
  EXPECT_EQ(events_.facts("stage.drift").size(), 1U);
  const auto record = read_stage_record(directory_.path());
  EXPECT_NEAR(record->pictures.back().scale, 1.0 + done->drift, 1e-12);
  EXPECT_EQ(record->pictures.front().scale, 1.0);
  std::filesystem::remove_all(directory_.path() / "frames");
  slow.gradient.drift_limit = done->drift / 20.0;
  const auto refused = capture(slow);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("let them warm up"));
}

TEST_F(GradientSequenceTest, ALampThatDoesNotShineIsFoundAndDoneWithout) {
  std::size_t front = 0;
  for (std::size_t n = 0; n < tiny_.lights.size(); ++n)
    if (tiny_.lights[n].position.z > tiny_.lights[front].position.z) front = n;
  tiny_.sphere.dead_lights = {static_cast<int>(front)};
  traced_ = tiny_.path();
  const auto done = capture(task());
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->dead_lamps, std::vector<int>{static_cast<int>(front)});
  const auto record = read_stage_record(directory_.path());
  EXPECT_EQ(record->lights[front].intensity, 0.0);
  EXPECT_EQ(record->pictures[0].codes[front], 0);
  const auto again = capture(task());  // remembered
  ASSERT_TRUE(again);
  EXPECT_EQ(again->taken, 0);
  EXPECT_EQ(again->dead_lamps, done->dead_lamps);
}

TEST_F(GradientSequenceTest, AFullDiskIsSaidBeforeAnythingIsTaken) {
  free_bytes_ = 5'000'000;
  const auto done = capture(task());
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(done.error().message, HasSubstr("and 5000000 are free: make room"));
  EXPECT_FALSE(std::filesystem::exists(directory_.path() / "frames" / "constant"));
}

TEST_F(GradientSequenceTest, NothingInTheMiddleIsSaid) {
  faults_ = {{.kind = sim::FaultKind::kBlackFrame, .count = 100000}};
  const auto done = capture(task());
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("lens cap"));
}

}  // namespace
}  // namespace opaline::capture
