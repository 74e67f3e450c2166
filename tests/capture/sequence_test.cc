#include "capture/sequence.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/io/dataset_io.h"
#include "capture/patterns.h"
#include "tests/support/sequence_run.h"

namespace opaline::capture {
namespace {

using ::testing::IsEmpty;
namespace fs = std::filesystem;

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

// Regions of 4 x 4 mm on 8 x 8 mm: what is lit or within 1.5 mm of it is left out, by the distance of a cell's middle
// to the rectangle.
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

TEST_F(SequenceTest, RefusesOptionsThatMakeNoSense) {
  task_.options.exposures.ratio = 0.8;
  const auto summary = run(dir_.path());
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(summary.error().message, "capture.exposures.ratio = 0.8; expected > 1 and at most 16");
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
