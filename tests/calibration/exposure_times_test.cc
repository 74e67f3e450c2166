#include "calibration/exposure_times.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/measured_station.h"
#include "calibration/record.h"
#include "capture/region_taker.h"
#include "sim/sensor.h"

namespace opaline::calibration {
namespace {

constexpr int kSize = 128;
constexpr int kExposures = 7;  // 1/30 s, each twice the one before
constexpr int kLate = 4;       // the one that lasts longer than is reported

double reported(int exposure) { return std::ldexp(1.0 / 30.0, exposure); }

sim::CameraOptics optics() {
  sim::CameraOptics o;
  o.model.width = o.model.height = kSize;
  o.hot_pixel_fraction = 0.0;
  o.dark_electrons_per_second = 0.0;
  return o;
}

std::vector<double> linear_from(const sim::CameraOptics& o) {
  std::vector<double> linear;
  for (int code = 0; code <= 4095; ++code) linear.push_back(code - o.black_level);
  return linear;
}

/// What a shutter measures that keeps one exposure open by `late` times too long.
ExposureTimes measure(double late) {
  const sim::CameraOptics o = optics();
  const sim::Sensor sensor(o, 1);
  std::vector<Frame> first;
  std::vector<Frame> second;
  for (int j = 0; j < kExposures; ++j) {
    const double t = reported(j) * (j == kLate ? late : 1.0);
    Image<float> light(kSize, kSize, 3);
    for (std::size_t i = 0; i < light.samples().size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(light.samples().size());
      light.samples()[i] = static_cast<float>(t * 2.5e-4 * std::pow(200.0, share - 1.0));
    }
    for (std::vector<Frame>* frames : {&first, &second}) {
      Frame frame;
      frame.pixels = sensor.read(light, t, 10 + first.size() + 100 * second.size());
      frame.exposure = std::chrono::nanoseconds(std::llround(1e9 * reported(j)));
      frames->push_back(std::move(frame));
    }
  }
  return measure_exposures(first,
                           second,
                           {o.black_level, 4095.0},
                           linear_from(o),
                           Image<std::uint8_t>(kSize, kSize, 1, 1));
}

TEST(ExposureTimes, FindsTheExposureThatLastsLongerThanTheCameraSays) {
  const ExposureTimes times = measure(1.006);
  ASSERT_EQ(times.exposures.size(), static_cast<std::size_t>(kExposures));
  for (int j = 0; j < kExposures; ++j) {
    const auto& one = times.exposures[static_cast<std::size_t>(j)];
    EXPECT_NEAR(one.factor, j == kLate ? 1.006 : 1.0, 4.0 * one.deviation + 1e-5) << j;
    EXPECT_LT(one.deviation, 0.001) << j;
  }
  const auto corrections = times.corrections();
  ASSERT_EQ(corrections.size(), static_cast<std::size_t>(kExposures));
  EXPECT_NEAR(corrections[kLate].factor, 1.006, 0.003);
  EXPECT_EQ(corrections[0].factor, 1.0);
}

TEST(ExposureTimes, CorrectsNothingWhereTheCameraIsRight) {
  const ExposureTimes times = measure(1.0);
  EXPECT_TRUE(times.corrections().empty());
  EXPECT_LT(times.largest_error, 0.002);
}

capture::CapturedFrame frame_of(double seconds) {
  capture::CapturedFrame captured;
  captured.exposure_asked = std::chrono::nanoseconds(std::llround(1e9 * seconds));
  captured.frame.exposure = captured.exposure_asked;
  captured.frame.pixels = Image<std::uint16_t>(kSize, kSize, 3, 70);
  return captured;
}

TEST(ExposureTimes, AreWhatACaptureDividesBy) {
  Measured measured;
  measured.exposure_factors = {{0.1, 1.0}, {1.0, 1.006}, {2.0, 0.996}};
  capture::StationCalibration given;
  given.camera.model.width = given.camera.model.height = kSize;
  given.camera.model.fx = given.camera.model.fy = 1000.0;
  const capture::CameraCalibration camera = with_measured(given, measured).camera;
  EXPECT_TRUE(capture::validate(with_measured(given, measured)));
  const Image<std::uint8_t> seen(kSize, kSize, 1, 1);
  std::vector<capture::CapturedFrame> frames;
  frames.push_back(frame_of(1.0));
  const capture::BlackFrames black(std::move(frames), camera, seen);
  const auto pair = black.pair(frame_of(1.0));
  ASSERT_TRUE(pair);
  EXPECT_DOUBLE_EQ(pair->light_seconds, 1.006);
  EXPECT_DOUBLE_EQ(pair->black_seconds, 1.006);
  EXPECT_NEAR(capture::exposed_seconds(camera, std::sqrt(0.1)), std::sqrt(0.1) * 1.003, 1e-12);
  EXPECT_DOUBLE_EQ(capture::exposed_seconds(camera, 0.01), 0.01);
  EXPECT_DOUBLE_EQ(capture::exposed_seconds(camera, 8.0), 8.0 * 0.996);
}

TEST(ExposureTimes, AreKeptInTheRecord) {
  Record record;
  record.measured.exposure_factors = {{0.5, 1.004}, {1.0, 1.0}};
  const auto read = record_from_text(to_text(record), "calibration.json");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->measured.exposure_factors.size(), 2u);
  EXPECT_EQ(read->measured.exposure_factors[0].reported_s, 0.5);
  EXPECT_EQ(read->measured.exposure_factors[0].factor, 1.004);
}

}  // namespace
}  // namespace opaline::calibration
