#include "capture/sequence.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/io/dataset_io.h"
#include "capture/patterns.h"
#include "tests/support/recording_files.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"

namespace opaline::capture {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
namespace fs = std::filesystem;

using Files = std::vector<std::pair<std::string, std::vector<std::byte>>>;

/// What must be equal whatever happened on the way: HDR pictures and the dataset.
Files results_of(const fs::path& directory) {
  Files files = support::files_below(directory / "hdr");
  for (const char* name : {"dataset.exr", "dataset_light.exr", "dataset.json"}) {
    auto bytes = read_bytes(directory / name, 1u << 30);
    files.emplace_back(name, bytes ? *std::move(bytes) : std::vector<std::byte>{});
  }
  return files;
}

class SequenceTest : public ::testing::Test {
 protected:
  Result<CaptureSummary> run(const fs::path& directory, std::stop_token stop = {}) {
    return run(directory, support::unsynced_files(), std::move(stop));
  }
  Result<CaptureSummary> run(const fs::path& directory,
                             FileOperations& files,
                             std::stop_token stop = {}) {
    events_ = std::make_unique<support::RecordingSink>();
    return run(directory, files, *events_, std::move(stop));
  }
  Result<CaptureSummary> run(const fs::path& directory,
                             FileOperations& files,
                             EventSink& events,
                             std::stop_token stop) {
    support::TinyStation tiny(options_);
    const Workplace workplace{directory, files, events, free_bytes_};
    auto summary = capture_session(task_, tiny.station(), workplace, stop);
    lamp_on_ = tiny.rig().status()->lamp_on;
    exposures_ = tiny.rig().status()->exposures;
    return summary;
  }
  /// An undisturbed run's results, taken once for all tests.
  static const Files& undisturbed() {
    static const Files files = [] {
      const testing::TemporaryDirectory dir;
      support::TinyStation tiny(support::tiny_rig());
      NullSink events;
      const auto task = support::tiny_task(support::tiny_rig());
      const auto done = capture_session(
          task, tiny.station(), {dir.path(), support::unsynced_files(), events}, {});
      EXPECT_TRUE(done) << done.error().message;
      return results_of(dir.path());
    }();
    return files;
  }
  void expect_recovers_from(sim::Faults faults, const std::string& fault) {
    expect_one_retake(std::move(faults), fault);
    EXPECT_EQ(results_of(dir_.path()), undisturbed());
  }
  void expect_one_retake(sim::Faults faults, const std::string& fault) {
    options_.faults = std::move(faults);
    const auto summary = run(dir_.path());
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->retaken, 1);
    const auto retaken = events_->facts("region.retaken");
    ASSERT_EQ(retaken.size(), 1u);
    EXPECT_EQ(retaken[0]["fault"], fault) << retaken[0].dump();
  }

  testing::TemporaryDirectory dir_;
  sim::RigOptions options_ = support::tiny_rig();
  CaptureTask task_ = support::tiny_task(options_);
  std::unique_ptr<support::RecordingSink> events_;
  std::function<Result<std::uint64_t>(const fs::path&)> free_bytes_;
  bool lamp_on_ = true;
  std::uint64_t exposures_ = 0;
};

TEST_F(SequenceTest, CapturesEveryRegionAndHeldOutLightIntoADataset) {
  const auto summary = run(dir_.path());
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->lights, 11);
  EXPECT_EQ(summary->taken, 11);
  EXPECT_THAT(summary->unusable, IsEmpty());
  EXPECT_FALSE(lamp_on_);
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->illuminations.size(), 11u);
  EXPECT_EQ(set->illuminations[0].name, "region_0_0");
  EXPECT_EQ(std::ranges::count(set->illuminations, true, &Illumination::held_out), 7);
  EXPECT_TRUE(fs::exists(dir_.path() / "hdr" / "region_1_1.exr"));
}

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

// Regions of 4 x 4 mm on 8 x 8 mm: what is lit or within 1.5 mm of it is left out, by the distance of a cell's middle
// to the rectangle.
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

TEST_F(SequenceTest, LeavesOutWhatIsLitDirectlyWhereTheLitFaceIsSeen) {
  task_.sample.lit_face = task_.sample.seen_face;
  task_.options.direct_light_margin_mm = 1.5;
  ASSERT_TRUE(run(dir_.path()));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set) << set.error().message;
  for (int region = 0; region < 4; ++region) {
    const Illumination& light = set->illuminations[static_cast<std::size_t>(region)];
    const double left = 4.0 * (region % 2);
    const double top = region < 2 ? 0.0 : 4.0;
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        const double dx = std::max({0.0, left - (x + 0.5), x + 0.5 - (left + 4.0)});
        const double dy = std::max({0.0, top - (y + 0.5), y + 0.5 - (top + 4.0)});
        const bool kept = std::hypot(dx, dy) > 1.5;
        EXPECT_EQ(light.mask.at(x, y), kept ? 1 : 0) << light.name << " " << x << ", " << y;
      }
    }
  }
}

// Twice the same station, with a surface that reflects and without: the pictures under uniform light differ by
// rho_s E. Noise is below 1 % of rho_s E by the variances that come with the pictures; the texture bends by up to 3 %
// within a cell, as the hills do.
TEST_F(SequenceTest, SeesTheSurfaceUnderUniformLightWhereTheLitFaceIsSeen) {
  auto responses = *support::tiny_responses();
  responses.lit_face = responses.seen_face;
  options_.camera.psf_sigma_px = 0.0;
  task_ = support::tiny_task(options_);
  task_.sample.lit_face = task_.sample.seen_face;
  task_.options.patterns.uniform_light = true;
  const auto picture = [&](double reflectance) {
    const testing::TemporaryDirectory directory;
    options_.surface.reflectance = reflectance;
    support::TinyStation tiny(options_, std::make_shared<const TransportResponses>(responses));
    NullSink events;
    const auto done = capture_session(
        task_, tiny.station(), {directory.path(), support::unsynced_files(), events}, {});
    EXPECT_TRUE(done) << done.error().message;
    return read_dataset(directory.path())->uniform.value();
  };
  const Illumination shiny = picture(0.02);
  const Illumination dull = picture(0.0);
  EXPECT_EQ(shiny.name, "uniform");
  EXPECT_TRUE(shiny.held_out);
  sim::SurfaceOptions real = options_.surface;
  real.reflectance = 0.02;
  const Image<float> rho = sim::surface_reflectance(real, task_.sample.block, Face::kZMax);
  for (int y = 1; y < 7; ++y) {
    for (int x = 1; x < 7; ++x) {
      ASSERT_EQ(shiny.mask.at(x, y), 1);
      const double found =
          (shiny.radiance.at(x, y, 1) - dull.radiance.at(x, y, 1)) / shiny.irradiance.at(x, y, 1);
      EXPECT_NEAR(found, rho.at(x, y, 1), 0.05 * rho.at(x, y, 1)) << x << ", " << y;
    }
  }
}

// The rig's truth under each region against what was measured: how well, the next test says.
TEST_F(SequenceTest, MeasuresTheRadianceTheSampleSends) {
  options_.camera.psf_sigma_px = 0.0;
  task_ = support::tiny_task(options_);
  ASSERT_TRUE(run(dir_.path()));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set);
  support::TinyStation tiny(options_);
  sim::SimProjector projector(tiny.rig());
  ASSERT_TRUE(projector.open());
  const auto patterns = make_patterns(task_.options.patterns,
                                      task_.sample.block,
                                      task_.sample.lit_face,
                                      task_.calibration.projector);
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(projector.show(patterns->black, {}));
    tiny.clock().advance(std::chrono::seconds(1));
    const auto leak = tiny.rig().truth();
    ASSERT_TRUE(projector.show(patterns->lights[i].pattern, {}));
    tiny.clock().advance(std::chrono::seconds(1));
    const auto truth = tiny.rig().truth();
    ASSERT_TRUE(truth);
    const Illumination& measured = set->illuminations[i];
    double worst = 0.0;
    for (int y = 1; y < 7; ++y) {
      for (int x = 1; x < 7; ++x) {
        ASSERT_EQ(measured.mask.at(x, y), 1);
        for (int c = 0; c < 3; ++c) {
          const double real =
              truth->surface_radiance.at(x, y, c) - leak->surface_radiance.at(x, y, c);
          worst = std::max(worst, std::abs(measured.radiance.at(x, y, c) / real - 1.0));
        }
      }
    }
    EXPECT_LT(worst, 0.03) << measured.name;  // the hills bend by about 2 % within a cell
  }
}

// Two stations that differ in their noise alone: their differences, in units of the deviations that
// go with them, have squares of mean 1. n = 11 lights x 64 cells x 3 channels scatter it by
// sqrt(2 / n) = 0.03; four times that.
TEST_F(SequenceTest, KnowsTheVarianceOfWhatItMeasured) {
  options_.camera.hot_pixel_fraction = 0.0;
  const testing::TemporaryDirectory other;
  options_.seed = 1;
  ASSERT_TRUE(run(dir_.path()));
  options_.seed = 2;
  ASSERT_TRUE(run(other.path()));
  const auto a = read_dataset(dir_.path());
  const auto b = read_dataset(other.path());
  ASSERT_TRUE(a && b);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < a->illuminations.size(); ++i) {
    const Illumination& one = a->illuminations[i];
    const Illumination& two = b->illuminations[i];
    for (std::size_t k = 0; k < one.radiance.samples().size(); ++k) {
      const double difference = one.radiance.samples()[k] - two.radiance.samples()[k];
      sum += difference * difference /
             (one.radiance_variance.samples()[k] + two.radiance_variance.samples()[k]);
      count += 1.0;
    }
  }
  EXPECT_EQ(count, 11 * 64 * 3);
  EXPECT_NEAR(sum / count, 1.0, 0.12);
}

TEST_F(SequenceTest, GivesTheIrradianceThatTheProjectorSends) {
  ASSERT_TRUE(run(dir_.path()));
  const auto set = read_dataset(dir_.path());
  ASSERT_TRUE(set);
  support::TinyStation tiny(options_);
  sim::SimProjector projector(tiny.rig());
  ASSERT_TRUE(projector.open());
  const auto patterns = make_patterns(task_.options.patterns,
                                      task_.sample.block,
                                      task_.sample.lit_face,
                                      task_.calibration.projector);
  for (std::size_t i = 0; i < patterns->lights.size(); ++i) {
    ASSERT_TRUE(projector.show(patterns->lights[i].pattern, {}));
    tiny.clock().advance(std::chrono::seconds(1));
    const auto truth = tiny.rig().truth();
    for (int patch = 0; patch < 16; ++patch) {  // of 2 x 2 cells
      double mean = 0.0;
      for (int k = 0; k < 4; ++k) {
        mean += 0.25 * set->illuminations[i].irradiance.at(
                           2 * (patch % 4) + k % 2, 2 * (patch / 4) + k / 2, 1);
      }
      const double leak = options_.projector.peak_irradiance[1] * options_.projector.black_level;
      EXPECT_NEAR(mean, truth->patch_irradiance[patch][1], 1.001 * leak);
    }
  }
}

TEST_F(SequenceTest, GivesTheSameBytesEachTime) {
  ASSERT_TRUE(run(dir_.path()));
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

TEST_F(SequenceTest, TakesNothingAgainThatIsThere) {
  ASSERT_TRUE(run(dir_.path()));
  const auto again = run(dir_.path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->taken, 0);
  EXPECT_EQ(exposures_, 0u);
  EXPECT_EQ(results_of(dir_.path()), undisturbed());
}

/// Asks to stop once the second light is on.
class StoppingSink : public NullSink {
 public:
  void progress(const Progress& progress) override {
    if (progress.detail["light"] == 2 && progress.detail.contains("exposure")) stop.request_stop();
  }
  std::stop_source stop;
};

TEST_F(SequenceTest, StopsWhenAskedWithTheLampDark) {
  StoppingSink events;
  const auto summary = run(dir_.path(), support::unsynced_files(), events, events.stop.get_token());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(fs::exists(dir_.path() / "frames" / "region_0_0" / "index.json"));
  EXPECT_FALSE(fs::exists(dir_.path() / "frames" / "region_0_1" / "index.json"));
  EXPECT_FALSE(lamp_on_);
}

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

TEST_F(SequenceTest, RefusesOptionsThatMakeNoSense) {
  task_.options.exposures.ratio = 0.8;
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(summary.error().message, "capture.exposures.ratio = 0.8; expected > 1 and at most 16");
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

TEST_F(SequenceTest, TellsHowFarItIs) {
  ASSERT_TRUE(run(dir_.path()));
  const auto all = events_->progresses();
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back().step, "capture");
  EXPECT_GT(all.back().fraction, 0.9);
  EXPECT_TRUE(all.back().seconds_left.has_value());
  EXPECT_EQ(all.back().detail["light"], 11);
  EXPECT_EQ(all.back().detail["lights"], 11);
  EXPECT_EQ(all.back().detail["region"], "held_out_small_2");
  EXPECT_TRUE(all.back().detail.contains("exposure"));
  EXPECT_EQ(all.front().detail["region"], "black");
  EXPECT_EQ(all.front().detail["exposure"], "0.0333 s");
  EXPECT_TRUE(std::ranges::is_sorted(all, {}, &Progress::fraction));
}

/// Another clock's time, a hundred seconds of which pass in a real one.
class HastyClock : public Clock {
 public:
  explicit HastyClock(Clock& clock) : clock_(clock) {}
  std::chrono::nanoseconds now() const override { return clock_.now(); }
  bool sleep(std::chrono::nanoseconds duration, std::stop_token stop) override {
    return clock_.sleep(duration, std::move(stop));
  }
  double pace() const override { return 100.0; }

 private:
  Clock& clock_;
};

TEST_F(SequenceTest, TellsTheTimeLeftInRealSeconds) {
  const auto seconds_left = [&](bool hasty) {
    const opaline::testing::TemporaryDirectory directory;
    support::TinyStation tiny(options_);
    HastyClock clock(tiny.clock());
    const Station station = tiny.station();
    support::RecordingSink sink;
    EXPECT_TRUE(capture_session(
        task_,
        {station.camera, station.projector, hasty ? static_cast<Clock&>(clock) : station.clock},
        {directory.path(), support::unsynced_files(), sink},
        {}));
    return sink.progresses().back().seconds_left.value_or(0.0);
  };
  const double left = seconds_left(false);
  EXPECT_GT(left, 0.0);
  EXPECT_NEAR(seconds_left(true), left / 100.0, 1e-6 * left);
}

}  // namespace
}  // namespace opaline::capture
