#include "sim/optics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "sim/sensor.h"
#include "sim/station_light.h"
#include "tests/support/simulated_station.h"

namespace opaline::sim {
namespace {

using ::testing::HasSubstr;

/// A camera without any of its faults but shot noise, and finely quantised.
CameraOptics plain_camera(int size) {
  CameraOptics camera;
  camera.model.width = camera.model.height = size;
  camera.vignetting = {};
  camera.read_noise_electrons = 0.0;
  camera.dark_electrons_per_second = 0.0;
  camera.hot_pixel_fraction = 0.0;
  camera.gain_electrons_per_code = 1.0;
  camera.bit_depth = 16;
  camera.full_well_electrons = 60000.0;
  return camera;
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

template <class Range>
Moments moments(const Range& samples) {
  Moments m;
  const auto n = static_cast<double>(samples.size());
  for (const auto sample : samples) m.mean += static_cast<double>(sample) / n;
  for (const auto sample : samples) {
    m.variance +=
        (static_cast<double>(sample) - m.mean) * (static_cast<double>(sample) - m.mean) / (n - 1.0);
  }
  return m;
}

/// Codes above black of a flat picture whose pixels collect `electrons` on average.
Moments flat_field(const CameraOptics& camera, double electrons) {
  const int size = camera.model.width;
  const Image<float> light(size, size, 3, static_cast<float>(electrons / camera.sensitivity[0]));
  const Image<std::uint16_t> codes = Sensor(camera, 7).read(light, 1.0, 42);
  Moments m = moments(codes.samples());
  m.mean -= camera.black_level;
  return m;
}

TEST(SensorNoise, QuantileIsTheNormalDistributionsOwn) {
  // Reference: standard tables to ten digits.
  EXPECT_NEAR(normal_quantile(0.5), 0.0, 1e-12);
  EXPECT_NEAR(normal_quantile(0.975), 1.9599639845, 3e-7);
  EXPECT_NEAR(normal_quantile(0.0013498980316301), -3.0, 5e-7);
  EXPECT_NEAR(normal_quantile(1e-12), -7.0344838253, 2e-6);
}

TEST(SensorNoise, ShotNoiseHasTheMeanForItsVariance) {
  // 3 x 128^2 samples: the mean is known to sqrt(m/n), the variance to m sqrt(2/n); tolerances are
  // 4 of each, plus the rounding to codes (1/12).
  for (const double electrons : {0.5, 5.0, 31.0, 33.0, 400.0, 20000.0}) {
    const double n = 3.0 * 128 * 128;
    const Moments m = flat_field(plain_camera(128), electrons);
    EXPECT_NEAR(m.mean, electrons, 4.0 * std::sqrt(electrons / n)) << electrons;
    EXPECT_NEAR(m.variance,
                electrons,
                4.0 * electrons * std::sqrt((2.0 + 1.0 / electrons) / n) + 1.0 / 12.0)
        << electrons;
  }
}

TEST(SensorNoise, ReadNoiseAddsItsVariance) {
  CameraOptics camera = plain_camera(128);
  camera.read_noise_electrons = 20.0;
  const double n = 3.0 * 128 * 128;
  const Moments m = flat_field(camera, 100.0);
  EXPECT_NEAR(m.variance, 500.0, 4.0 * 500.0 * std::sqrt(2.0 / n) + 1.0 / 12.0);
}

TEST(SensorNoise, ClipsAtFullWellAndAtTheLastCode) {
  CameraOptics camera = plain_camera(16);
  camera.full_well_electrons = 1000.0;
  EXPECT_NEAR(flat_field(camera, 50000.0).mean, 1000.0, 1e-9);
  camera.full_well_electrons = 1e9;
  EXPECT_NEAR(flat_field(camera, 1e6).mean, 65535.0 - camera.black_level, 1e-6);
}

TEST(SensorNoise, ResponseCurveIsAPowerLawAboveBlack) {
  CameraOptics camera = plain_camera(64);
  camera.response_gamma = 2.0;
  const double range = 65535.0 - camera.black_level;
  // The root of a noisy number is biased by -1/8 of its relative variance, 1/10000.
  EXPECT_NEAR(flat_field(camera, 10000.0).mean, range * std::sqrt(10000.0 / range), 0.0002 * range);
}

TEST(SensorNoise, HotPixelsStayWhereTheyAre) {
  CameraOptics camera = plain_camera(64);
  camera.hot_pixel_fraction = 0.01;
  const Sensor sensor(camera, 3);
  const Image<float> no_light(64, 64, 3);
  const auto a = sensor.read(no_light, 1.0, 1);
  const auto b = sensor.read(no_light, 1.0, 2);
  int hot = 0;
  for (std::size_t i = 0; i < a.samples().size(); ++i) {
    EXPECT_EQ(a.samples()[i] > 1000, b.samples()[i] > 1000);
    hot += a.samples()[i] > 1000 ? 1 : 0;
  }
  EXPECT_NEAR(hot / 3.0, 41.0, 4.0 * std::sqrt(41.0));
}

TEST(ColourWheel, WholeTurnsSeeEveryChannelAlikeFromAnyPhase) {
  for (const double phase : {0.0, 0.011, 0.02, 0.0333}) {
    for (const double lit : wheel_lit_seconds(1.0 / 30.0, phase, phase + 4.0 / 30.0)) {
      EXPECT_NEAR(lit, 4.0 / 30.0, 1e-12);
    }
  }
}

TEST(ColourWheel, AThirdOfATurnMaySeeOneChannelOnly) {
  const Rgb lit = wheel_lit_seconds(1.0 / 30.0, 0.0, 1.0 / 90.0);
  EXPECT_NEAR(lit[0], 1.0 / 30.0, 1e-12);
  EXPECT_NEAR(lit[1], 0.0, 1e-12);
  EXPECT_NEAR(lit[2], 0.0, 1e-12);
}

TEST(PointSpread, KeepsTheLightAlsoAtTheBorder) {
  Image<float> points(40, 30, 3);
  points.at(20, 15, 0) = 5.0f;
  points.at(0, 0, 1) = 5.0f;
  points.at(39, 12, 2) = 5.0f;
  const Image<float> spread = blurred(points, 1.7);
  double sum = 0.0;
  for (const float sample : spread.samples()) sum += sample;
  EXPECT_NEAR(sum, 15.0, 1e-4);  // float rounding over a few hundred samples
  EXPECT_FLOAT_EQ(spread.at(18, 15, 0), spread.at(22, 15, 0));
  EXPECT_FLOAT_EQ(spread.at(20, 13, 0), spread.at(20, 17, 0));
}

TEST(PointSpread, HasTheVarianceAskedFor) {
  Image<float> point(41, 41, 1);
  point.at(20, 20) = 1.0f;
  const Image<float> spread = blurred(point, 1.5);
  double second_moment = 0.0;
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) second_moment += 1.0 * (x - 20) * (x - 20) * spread.at(x, y);
  }
  EXPECT_NEAR(second_moment, 2.25, 0.01);  // cut at four sigma
}

TEST(ProjectorOptics, GammaAndBlackLevelGiveThePatchItsIrradiance) {
  RigOptions options = support::tiny_rig();
  options.projector.vignetting = {};
  const auto irradiance = [&](std::uint8_t code) {
    return LitFace(options.projector, support::tiny_responses()->block, Face::kZMin, 4, 4)
        .irradiance(support::flat_pattern(options, 1, code).codes)[5][1];
  };
  // Single precision inside.
  EXPECT_NEAR(irradiance(255), 1e-3, 1e-9);
  EXPECT_NEAR(irradiance(0), 1e-6, 1e-12);
  EXPECT_NEAR(irradiance(128), 1e-3 * (0.001 + 0.999 * std::pow(128 / 255.0, 2.2)), 1e-9);
}

TEST(ProjectorOptics, APatchHalfCoveredGetsHalfTheLight) {
  RigOptions options = support::tiny_rig();
  options.projector.vignetting = {};
  options.projector.black_level = 0.0;
  drivers::Pattern pattern = support::flat_pattern(options, 1, 0);
  for (int y = 10; y < 20; ++y) {
    for (int x = 20; x < 35; ++x) pattern.codes.at(x, y, 0) = 255;  // 1.5 of 4 patches of 10 pixels
  }
  options.projector.offset_x_px = 20.25;  // a quarter of a pixel to the side
  const auto patches =
      LitFace(options.projector, support::tiny_responses()->block, Face::kZMin, 4, 4)
          .irradiance(pattern.codes);
  EXPECT_NEAR(patches[0][0], 1e-3, 1e-9);
  EXPECT_NEAR(patches[1][0], 0.475e-3, 1e-9);
  EXPECT_NEAR(patches[2][0], 0.0, 1e-12);
  EXPECT_NEAR(patches[4][0], 0.0, 1e-12);
}

TEST(ProjectorOptics, BesideTheFieldItIsDark) {
  RigOptions options = support::tiny_rig();
  options.projector.vignetting = {};
  options.projector.offset_x_px = -10.0;  // the first patch lies outside
  const auto patches =
      LitFace(options.projector, support::tiny_responses()->block, Face::kZMin, 4, 4)
          .irradiance(support::flat_pattern(options, 1, 255).codes);
  EXPECT_EQ(patches[0][0], 0.0);
  EXPECT_NEAR(patches[1][0], 1e-3, 1e-9);
}

// 8 x 8 mm of a face, lit from 200 mm away at 30 degrees by a lens without distortion: by the definition, at a rectangle's middle. A
// rectangle is 2 mm, so its mean is within (1 / 200)^2 of that.
TEST(ProjectorOptics, InPerspectiveLightFallsOffWithDistanceAndAngle) {
  RigOptions options = support::tiny_rig();
  const Block block = support::tiny_responses()->block;
  ProjectorOptics& p = options.projector;
  p.kind = ProjectorKind::kPerspective;
  p.vignetting = {};
  p.lens = {.width = 80,
            .height = 60,
            .fx = 1000.0,
            .fy = 1000.0,
            .cx = 41.0,
            .cy = 29.0,
            .camera_from_sample = {}};
  const Vec3 lamp{4.0 + 100.0, 4.0, -173.2};
  p.lens.camera_from_sample = look_at(lamp, {4.0, 4.0, 0.0}, {0.0, 1.0, 0.0});
  p.reference_distance_mm = 150.0;
  const auto lit =
      LitFace(p, block, Face::kZMin, 4, 4).irradiance(support::flat_pattern(options, 1, 255).codes);
  for (int i = 0; i < 16; ++i) {
    const int down = i / 4;
    const Vec3 way = lamp - Vec3{2.0 * (i % 4) + 1.0, 2.0 * down + 1.0, 0.0};
    const double expected = 1e-3 * 150.0 * 150.0 / dot(way, way) * -way.z / length(way);
    EXPECT_NEAR(lit[static_cast<std::size_t>(i)][1], expected, 5e-5 * expected) << i;
  }
  const auto behind =
      LitFace(p, block, Face::kZMax, 4, 4).irradiance(support::flat_pattern(options, 1, 255).codes);
  EXPECT_EQ(behind[5][1], 0.0);
}

// What one pixel lights lies where the inverse of its lens says, distortion and all: the middle of its light, by rectangles of a quarter of a
// pixel, is its ray's place.
TEST(ProjectorOptics, InPerspectiveAPixelLightsWhereItsRayFalls) {
  RigOptions options = support::tiny_rig();
  const Block block = support::tiny_responses()->block;
  ProjectorOptics& p = options.projector;
  p.kind = ProjectorKind::kPerspective;
  p.lens = {.width = 80,
            .height = 60,
            .fx = 1000.0,
            .fy = 1000.0,
            .cx = 41.0,
            .cy = 29.0,
            .camera_from_sample = {}};
  p.lens.distortion = {20.0, 0.0, 0.01, -0.02, 0.0};
  p.lens.camera_from_sample = look_at({40.0, -20.0, -190.0}, {4.0, 4.0, 0.0}, {0.0, 1.0, 0.0});
  p.black_level = 0.0;
  drivers::Pattern pattern = support::flat_pattern(options, 1, 0);
  pattern.codes.at(52, 37, 0) = 255;
  const int n = 160;  // of 0.05 mm
  const auto lit = LitFace(p, block, Face::kZMin, n, n).irradiance(pattern.codes);
  double sum = 0.0;
  double column = 0.0;
  double row = 0.0;
  for (int i = 0; i < n * n; ++i) {
    const double e = lit[static_cast<std::size_t>(i)][0];
    sum += e;
    column += e * (i % n + 0.5) * 8.0 / n;
    const int down = i / n;
    row += e * (down + 0.5) * 8.0 / n;
  }
  const FacePlace place = lit_by(p, block, Face::kZMin, 52.5, 37.5);
  ASSERT_GT(sum, 0.0);
  EXPECT_NEAR(column / sum, place.column, 0.01);
  EXPECT_NEAR(row / sum, place.row, 0.01);
  const auto seen = p.lens.project({place.column, place.row, 0.0});
  EXPECT_NEAR(seen.x, 52.5, 1e-6);
  EXPECT_NEAR(seen.y, 37.5, 1e-6);
}

TEST(StationLight, AFlatSurfaceIsSeenFlatAndEndsAtTheEdge) {
  RigOptions options = support::tiny_rig();
  options.camera.psf_sigma_px = 0.0;
  auto responses = *support::tiny_responses();
  for (auto& patch : responses.patches) {
    std::fill(patch.radiance.samples().begin(), patch.radiance.samples().end(), 1.0f / 16.0f);
  }
  options.projector.vignetting = {};
  const StationOptics optics(
      options.camera, options.projector, std::make_shared<TransportResponses>(responses));
  const StationLight light = optics.light(support::flat_pattern(options, 1, 255).codes);
  // The face covers 40 of 64 pixels, from pixel 12 to 52.
  EXPECT_NEAR(light.sensor_radiance.at(12, 12), 1e-3, 1e-8);
  EXPECT_NEAR(light.sensor_radiance.at(51, 51), 1e-3, 1e-8);
  EXPECT_EQ(light.sensor_radiance.at(11, 30), 0.0f);
  EXPECT_EQ(light.sensor_radiance.at(30, 52), 0.0f);
}

TEST(StationLight, ASymmetricSceneGivesASymmetricPicture) {
  const RigOptions options = support::tiny_rig();
  const StationOptics optics(options.camera, options.projector, support::tiny_responses());
  const Image<float> picture =
      optics.light(support::flat_pattern(options, 1, 255).codes).sensor_radiance;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      EXPECT_NEAR(picture.at(x, y, 1), picture.at(63 - x, y, 1), 1e-5 * picture.at(32, 32, 1));
      EXPECT_NEAR(picture.at(x, y, 1), picture.at(x, 63 - y, 1), 1e-5 * picture.at(32, 32, 1));
    }
  }
}

TEST(StationLight, ALitPatchAppearsWhereTheCameraModelProjectsIt) {
  RigOptions options = support::tiny_rig();
  options.camera.model.distortion = {-4.0, 0.0, 0.01, 0.0, 0.0};
  options.camera.model.camera_from_sample =
      look_at({30.0, 10.0, 100.0}, {4.0, 4.0, 4.0}, {0.0, 1.0, 0.0});
  options.camera.psf_sigma_px = 0.0;
  auto responses = *support::tiny_responses();
  for (auto& patch : responses.patches)
    std::fill(patch.radiance.samples().begin(), patch.radiance.samples().end(), 0.0f);
  responses.patches[0].radiance.at(6, 2, 0) = 1.0f;  // one bright cell
  const StationOptics optics(
      options.camera, options.projector, std::make_shared<TransportResponses>(responses));
  const Image<float> picture =
      optics.light(support::flat_pattern(options, 1, 255).codes).sensor_radiance;
  double sum = 0.0;
  double x_sum = 0.0;
  double y_sum = 0.0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      sum += picture.at(x, y, 0);
      x_sum += (x + 0.5) * picture.at(x, y, 0);
      y_sum += (y + 0.5) * picture.at(x, y, 0);
    }
  }
  const auto expected = options.camera.model.project({6.5, 2.5, 4.0});
  EXPECT_NEAR(x_sum / sum, expected.x, 0.06);  // a cell is 5 x 4.6 pixels, sampled 4 x 4 a pixel
  EXPECT_NEAR(y_sum / sum, expected.y, 0.06);
}

TEST(RigOptions, WhatMakesNoSenseIsNamed) {
  RigOptions options;
  EXPECT_TRUE(validate(options));
  options.camera.gain_electrons_per_code = -1.0;
  const auto gain = validate(options);
  ASSERT_FALSE(gain);
  EXPECT_THAT(gain.error().message,
              HasSubstr("camera: gain_electrons_per_code = -1; expected > 0"));
  options = {};
  options.projector.vignetting = {-1.5, 0.0, 0.0};
  EXPECT_FALSE(validate(options));
  options = {};
  options.time_factor = 0.0;
  EXPECT_FALSE(validate(options));
}

}  // namespace
}  // namespace opaline::sim
