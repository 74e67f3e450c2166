#include "capture/sequence.h"

#include <gmock/gmock.h>

#include "capture/patterns.h"
#include "tests/support/sequence_run.h"

namespace opaline::capture {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

TEST_F(SequenceTest, RetakesTheRegionOfAStaleFrame) {
  expect_recovers_from({{sim::FaultKind::kStaleFrame, kFirstLight + 2, 1}}, "wrong_pattern");
}
TEST_F(SequenceTest, RetakesTheRegionOfADuplicateFrame) {
  expect_recovers_from({{sim::FaultKind::kDuplicateFrame, kFirstLight + 2, 1}}, "duplicate");
}
TEST_F(SequenceTest, RetakesTheRegionOfATornFrame) {
  expect_recovers_from({{sim::FaultKind::kTornFrame, kFirstLight + 1, 0}}, "torn");
}
TEST_F(SequenceTest, RetakesTheRegionOfABlackFrame) {
  expect_recovers_from({{sim::FaultKind::kBlackFrame, kFirstLight + 3, 0}}, "black");
}
TEST_F(SequenceTest, RetakesTheRegionOfAMissingFrame) {
  expect_recovers_from({{sim::FaultKind::kMissingFrame, kFirstLight, 1}}, "device");
}
TEST_F(SequenceTest, RetakesTheRegionOfASkippedTrigger) {
  expect_recovers_from({{sim::FaultKind::kSkippedTrigger, kFirstLight + 3, 1}}, "missing");
}
TEST_F(SequenceTest, RetakesTheRegionOfATimeThatRanBackwards) {
  expect_recovers_from({{sim::FaultKind::kTimeBackwards, kFirstLight + 3, 1}}, "out_of_order");
}
TEST_F(SequenceTest, RetakesTheRegionOfAWrongExposure) {
  expect_recovers_from({{sim::FaultKind::kWrongExposure, kFirstLight + 3, 1}}, "wrong_exposure");
}
TEST_F(SequenceTest, RetakesTheRegionOfAPatternThatStuck) {
  expect_recovers_from({{sim::FaultKind::kPatternStuck, kFirstLight + 4}}, "wrong_pattern");
}
TEST_F(SequenceTest, ComesBackAfterALostCamera) {
  expect_recovers_from({{sim::FaultKind::kCameraLost, kFirstLight + 1, 1}}, "device");
}
TEST_F(SequenceTest, ComesBackAfterALostProjector) {
  expect_recovers_from({{sim::FaultKind::kProjectorLost, kFirstLight + 1}}, "device");
}

TEST_F(SequenceTest, GivesUpWhenTheRetriesAreUsedUpAndGoesOnLater) {
  options_.faults = {{sim::FaultKind::kTornFrame, kFirstLight + 2, 0, 1000}};
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message, AllOf(HasSubstr("region_1_0"), HasSubstr("torn")));
  EXPECT_FALSE(lamp_on_);
  options_.faults = {};
  const auto again = run(dir_.path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 9);
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, RetakesARegionWhoseFrameFileWasTruncatedAndNamesTheFile) {
  ASSERT_TRUE(run(dir_.path()));
  fs::path frame;
  for (const auto& entry : fs::directory_iterator(dir_.path() / "frames" / "region_0_1")) {
    if (entry.path().extension() == ".png") frame = entry.path();
  }
  fs::resize_file(frame, fs::file_size(frame) / 2);
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->taken, 1);
  const auto damaged = events_->facts("region.damaged");
  ASSERT_EQ(damaged.size(), 1u);
  EXPECT_THAT(damaged[0]["message"].get<std::string>(), HasSubstr(frame.string()));
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, RetakesARegionWhoseIndexListsMoreFramesThanThereCanBe) {
  ASSERT_TRUE(run(dir_.path()));
  const fs::path path = dir_.path() / "frames" / "region_0_1" / "index.json";
  auto index = nlohmann::json::parse(read_text(path).value());
  const auto frame = index["frames"][0];
  while (index["frames"].size() < 65) index["frames"].push_back(frame);
  ASSERT_TRUE(write_whole(system_files(), path, index.dump()));
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->taken, 1);
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, LeavesFramesOfANewerVersionAlone) {
  ASSERT_TRUE(run(dir_.path()));
  const fs::path path = dir_.path() / "frames" / "region_0_1" / "index.json";
  const std::string newer = R"({"format": 2, "frames": "otherwise"})";
  ASSERT_TRUE(write_whole(system_files(), path, newer));
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(summary.error().message,
              AllOf(HasSubstr(path.string()), HasSubstr("newer version (format 2")));
  EXPECT_EQ(read_text(path).value(), newer);
}

TEST_F(SequenceTest, RetakesBlackFramesThatWereDamaged) {
  ASSERT_TRUE(run(dir_.path()));
  for (const auto& entry : fs::directory_iterator(dir_.path() / "frames" / "black")) {
    if (entry.path().extension() == ".png") fs::remove(entry.path());
  }
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->taken, 0);
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, TakesAgainWhatWasExposedOtherwise) {
  ASSERT_TRUE(run(dir_.path()));
  task_.options.exposures.ratio = 3.0;
  const testing::TemporaryDirectory undisturbed;
  ASSERT_TRUE(run(undisturbed.path()));
  fs::remove(dir_.path() / "frames" / "region_1_1" / "index.json");
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->taken, 11);
  EXPECT_EQ(results_of(dir_.path()), results_of(undisturbed.path()));
}

TEST_F(SequenceTest, SaysBeforehandThatTheDiskIsTooFullAndGoesOnOnceThereIsRoom) {
  free_bytes_ = [](const fs::path&) -> Result<std::uint64_t> { return 100'000; };
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(summary.error().message,
              AllOf(HasSubstr(dir_.path().string()), HasSubstr("bytes"), HasSubstr("100000")));
  EXPECT_EQ(exposures_, 0u);
  free_bytes_ = nullptr;
  ASSERT_TRUE(run(dir_.path()));
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, StopsNamingFileAndBytesWhenTheDiskFillsUpAndGoesOnOnceThereIsRoom) {
  for (const std::size_t room : {60'000u, 150'000u, 400'000u}) {
    support::FullDisk full(room);
    const auto log = EventLog::open(full, dir_.path() / "events.jsonl");
    ASSERT_TRUE(log && (*log)->append("job.started", {}));
    support::LogSink events(**log);
    const auto summary = run(dir_.path(), full, events, {});
    ASSERT_FALSE(summary) << room;
    EXPECT_TRUE((*log)->append("job.finished", {{"message", summary.error().message}})) << room;
    EXPECT_EQ(summary.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(summary.error().message,
                AllOf(HasSubstr(dir_.path().string()), HasSubstr("bytes"), HasSubstr("no space")));
    EXPECT_FALSE(lamp_on_);
  }
  ASSERT_TRUE(run(dir_.path()));
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, RefusesACameraThatIsNotTheCalibratedOne) {
  task_.calibration.camera.model.width = 65;
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, HasSubstr("64 x 64"));
}

/// Is unplugged in its tenth exposure; what is plugged in then has half the pixels.
class SwappedCamera : public drivers::Camera {
 public:
  explicit SwappedCamera(drivers::Camera& camera) : camera_(camera) {}
  Result<void> open() override {
    ++opens_;
    return camera_.open();
  }
  Result<drivers::CameraInfo> info() const override {
    auto info = camera_.info();
    if (info && opens_ > 1) info->width /= 2;
    return info;
  }
  Result<Frame> capture(const drivers::ExposureRequest& request, std::stop_token stop) override {
    if (++exposures_ == 10) return unavailable("unplugged");
    auto frame = camera_.capture(request, std::move(stop));
    if (!frame || opens_ == 1) return frame;
    frame->pixels = Image<std::uint16_t>(frame->pixels.width() / 2,
                                         frame->pixels.height(),
                                         3,
                                         static_cast<std::uint16_t>(exposures_));
    frame->sha256 = frame_hash(frame->pixels);
    return frame;
  }
  void close() noexcept override { camera_.close(); }

 private:
  drivers::Camera& camera_;
  int opens_ = 0;
  int exposures_ = 0;
};

TEST_F(SequenceTest, RefusesAnotherCameraPluggedInOnTheWay) {
  support::TinyStation tiny(options_);
  const Station station = tiny.station();
  SwappedCamera camera(station.camera);
  NullSink events;
  const auto summary = capture_session(task_,
                                       {camera, station.projector, station.clock},
                                       {dir_.path(), support::unsynced_files(), events},
                                       {});
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(summary.error().message, HasSubstr("32 x 64"));
}

}  // namespace
}  // namespace opaline::capture
