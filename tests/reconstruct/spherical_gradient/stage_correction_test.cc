#include "reconstruct/spherical_gradient/stage_correction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "capture/stage_patterns.h"
#include "drivers/stage_picture.h"
#include "sim/led_sphere.h"

namespace opaline::reconstruct {
namespace {

/// Two balls, 10 and 6 mm, as 156 lamps on 600 mm show them; green of the default material.
struct Scene {
  std::vector<SphereLight> lights = light_sphere(156, 600.0, 1.0);
  sim::LedSphereOptions options;
  sim::CameraOptics camera;
  StageRecord record;
  std::map<std::string, std::vector<std::uint8_t>> codes;

  Scene() {
    options.radii_mm = {10.0, 6.0};
    options.reduced_albedo = {0.96, 0.96, 0.96};
    options.translucency_mm = {1.4, 1.4, 1.4};
    options.paths = 150'000;
    camera.psf_sigma_px = 0.0;
    CameraModel& model = camera.model;
    model.width = 180;
    model.height = 110;
    model.fx = model.fy = 5000.0;
    model.cx = 90.0;
    model.cy = 55.0;
    model.distortion = {};
    model.camera_from_sample = look_at({0, 0, 1000}, {0, 0, 0}, {0, 1, 0});
    record.lights = lights;
    record.middle_x = 90.0;
    record.middle_y = 55.0;
    record.pixel_mm = 0.2;
    record.distance_mm = 1000.0;
  }
  StagePictures photograph(const capture::StagePatternOptions& how = {.specular = false}) {
    NullSink events;
    const auto sphere = *sim::LedSphere::create(options, lights, camera, events, {});
    StagePictures p;
    p.width = camera.model.width;
    p.height = camera.model.height;
    const auto patterns = capture::stage_patterns(lights, record.axes, how);
    for (const auto& pattern : *patterns) {
      const auto seen =
          sphere->light(drivers::stage_picture({1, pattern.codes}).codes).sensor_radiance;
      StagePictures::Picture picture{{}, {}, pattern.codes};
      for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x) {
          picture.radiance.push_back(seen.at(x, y, 1));
          picture.variance.push_back(static_cast<float>(std::pow(0.002 * seen.at(x, y, 1), 2)) +
                                     1e-20F);
        }
      if (pattern.name == "constant") {
        for (const float radiance : picture.radiance)
          p.measured.push_back(radiance > 0.0F ? kMeasured : kNotSeen);
        p.constant = std::move(picture);
      } else if (pattern.name.ends_with("_minus")) {
        p.minuses.push_back(std::move(picture));
      } else if (pattern.name.starts_with("gradient")) {
        p.gradients[static_cast<std::size_t>(pattern.name[9] - 'x')] = std::move(picture);
      }
    }
    return p;
  }
};

struct Errors {
  double normal_deg = 0.0;
  double diffusion = 0.0;  ///< mean of ln D over the truth
  double albedo = 0.0;     ///< mean of alpha' less the truth
  int found = 0;
};

/// Over the pixels within `edge` of a ball's radius.
Errors errors_of(const Scene& scene,
                 const GradientPictures& pictures,
                 std::size_t ball,
                 double edge) {
  ThreadTeam team(2);
  const auto maps = *estimate_scattering(pictures, BallTable::standard(), {}, team);
  const auto balls = sim::balls_of(scene.options);
  const double truth = sim::diffusion_of(0.96, 1.4);
  Errors e;
  int pixels = 0;
  for (int y = 0; y < maps.height; ++y)
    for (int x = 0; x < maps.width; ++x) {
      const auto seen = sim::see_ball(balls, scene.camera.model, x + 0.5, y + 0.5);
      if (!seen || seen->ball != ball) continue;
      const Vec3 n = seen->normal;
      if (n.x * n.x + n.y * n.y > edge * edge) continue;
      const std::size_t at = static_cast<std::size_t>(y) * maps.width + x;
      const double cosine =
          n.x * maps.normal_x[at] - n.y * maps.normal_y[at] + n.z * maps.normal_z[at];
      e.normal_deg += std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi;
      ++pixels;
      if (maps.left_out[at] != LeftOut::kFound) continue;
      e.diffusion += std::log(maps.diffusion[at] / truth);
      e.albedo += maps.reduced_albedo[at] - 0.96;
      ++e.found;
    }
  e.normal_deg /= pixels;
  e.diffusion /= e.found;
  e.albedo /= e.found;
  return e;
}

GradientPictures uncorrected(const StagePictures& p, const StageRecord& record) {
  GradientPictures g{p.width, p.height, record.pixel_mm, 1.0, {}, {}, p.measured};
  g.white = record.depolarised * surrounding_radiance(record.lights, p.constant.codes);
  g.radiance = {p.constant.radiance,
                p.gradients[0].radiance,
                p.gradients[1].radiance,
                p.gradients[2].radiance};
  g.variance = {p.constant.variance,
                p.gradients[0].variance,
                p.gradients[1].variance,
                p.gradients[2].variance};
  return g;
}

// What the correction itself may leave: 3 % of D, from its approximate light in the ball and the camera's perspective (1 % of the curvature). The
// traced light adds 1 %, the table 2 % (MapOptions).
TEST(StageCorrection, MakesAStagesPicturesThoseOfIdealPatterns) {
  Scene scene;
  const StagePictures pictures = scene.photograph();
  ThreadTeam team(2);
  const auto ideal = ideal_pictures(pictures, scene.record, 1.4, team);
  ASSERT_TRUE(ideal) << ideal.error().message;
  for (const std::size_t ball : {0U, 1U}) {
    const Errors raw = errors_of(scene, uncorrected(pictures, scene.record), ball, 0.8);
    const Errors after = errors_of(scene, *ideal, ball, 0.8);
    std::printf("ball %zu: normals %.3f -> %.3f deg, ln D %+.3f -> %+.3f, alpha %+.4f -> %+.4f\n",
                ball,
                raw.normal_deg,
                after.normal_deg,
                raw.diffusion,
                after.diffusion,
                raw.albedo,
                after.albedo);
    EXPECT_GT(std::abs(raw.diffusion), 0.04);  // or there would be nothing to correct
    EXPECT_LT(after.normal_deg, 0.5);
    EXPECT_NEAR(after.diffusion, 0.0, 0.06);
    EXPECT_NEAR(after.albedo, 0.0, 0.004);
    EXPECT_GT(after.found, 500);
  }
}

TEST(StageCorrection, ShiftedPatternsAndHalvesAgree) {
  Scene scene;
  scene.options.radii_mm = {8.0};
  scene.options.paths = 50'000;
  ThreadTeam team(2);
  const auto shifted = *ideal_pictures(scene.photograph(), scene.record, 1.4, team);
  const auto halves = *ideal_pictures(
      scene.photograph({.split = true, .specular = false}), scene.record, 1.4, team);
  int compared = 0;
  for (std::size_t at = 0; at < shifted.measured.size(); ++at) {
    if (shifted.measured[at] != kMeasured) continue;
    for (std::size_t k = 0; k < 4;
         ++k)  // whole codes and the approximate light in the ball: 0.5 % of white's picture
      EXPECT_NEAR(shifted.radiance[k][at], halves.radiance[k][at], 0.005 * shifted.radiance[0][at]);
    ++compared;
  }
  EXPECT_GT(compared, 1000);
}

TEST(StageCorrection, RefusesWhatDoesNotFit) {
  Scene scene;
  scene.options.radii_mm = {8.0};
  scene.options.paths = 10'000;
  StagePictures p = scene.photograph();
  ThreadTeam team(1);
  p.gradients[1].codes.pop_back();
  EXPECT_FALSE(ideal_pictures(p, scene.record, 1.4, team));
  p = scene.photograph();
  p.constant.codes.assign(p.constant.codes.size(), 0);
  EXPECT_EQ(ideal_pictures(p, scene.record, 1.4, team).error().message,
            "no lamp shines in the constant picture");
}

/// A ball of 400 pixels of radius, or every `step`-th of them, under 156 lamps that make light leave by a law of some shape.
struct LargeBall {
  StageRecord record;
  StagePictures pictures;

  explicit LargeBall(int step) {
    constexpr int kWhole = 480;
    constexpr double kRadiusPx = 400.0;
    constexpr double kPixelMm = 0.025;
    record.lights = light_sphere(156, 600.0, 1.0);
    record.pixel_mm = kPixelMm * step;
    record.middle_x = record.middle_y = 0.5 * kWhole / step + 0.5 - 0.5 / step;
    record.distance_mm = 1000.0;
    const auto patterns = *capture::stage_patterns(record.lights, record.axes, {.specular = false});
    pictures.width = pictures.height = kWhole / step;
    for (int k = 0; k < 4; ++k) {
      StagePictures::Picture picture{{}, {}, patterns[static_cast<std::size_t>(k)].codes};
      for (int y = 0; y < kWhole; y += step)
        for (int x = 0; x < kWhole; x += step) {
          const Vec3 across{
              (x + 0.5 - 0.5 * kWhole) / kRadiusPx, (0.5 * kWhole - y - 0.5) / kRadiusPx, 0.0};
          const Vec3 normal{across.x, across.y, std::sqrt(1.0 - dot(across, across))};
          const double light = radiance(normal, normal * (kRadiusPx * kPixelMm), picture.codes);
          picture.radiance.push_back(static_cast<float>(light));
          picture.variance.push_back(1e-20F);
        }
      (k == 0 ? pictures.constant : pictures.gradients[static_cast<std::size_t>(k - 1)]) =
          std::move(picture);
    }
    pictures.measured.assign(pictures.constant.radiance.size(), kMeasured);
  }
  double radiance(Vec3 normal, Vec3 at, const std::vector<std::uint8_t>& codes) const {
    double sum = 0.0;
    for (std::size_t n = 0; n < record.lights.size(); ++n) {
      const Vec3 to = record.lights[n].position - at;
      const double cosine = dot(normal, normalized(to));
      sum += codes[n] / dot(to, to) * (0.2 * (1.0 + cosine) + std::max(0.0, cosine));
    }
    return sum;
  }
};

// What blocks leave out is of second order in how normals turn within one, 0.005 radians from its middle, in a difference of 2 % that changes over 0.15: half of
// 0.02 (0.005 / 0.15)^2, some 1e-5; their depths differ too, by windows of other sizes.
TEST(StageCorrection, BlocksOfPixelsAreCorrectedAsEachPixelIs) {
  constexpr int kStep = 8;
  const LargeBall fine(1);        // blocks of 4
  const LargeBall coarse(kStep);  // normals turn by 0.02 a pixel: each by itself
  ThreadTeam team(2);
  const auto blocks = *ideal_pictures(fine.pictures, fine.record, 1.4, team);
  const auto pixels = *ideal_pictures(coarse.pictures, coarse.record, 1.4, team);
  double worst = 0.0;
  double changed = 0.0;
  for (int y = 8; y < coarse.pictures.height - 8; ++y)
    for (int x = 8; x < coarse.pictures.width - 8; ++x) {
      const auto at = static_cast<std::size_t>(y * coarse.pictures.width + x);
      const auto same = static_cast<std::size_t>(y * kStep * fine.pictures.width + x * kStep);
      const double unit = pixels.radiance[0][at];
      for (std::size_t k = 0; k < 4; ++k)
        worst = std::max(worst, std::abs(blocks.radiance[k][same] - pixels.radiance[k][at]) / unit);
      const double was =
          coarse.pictures.gradients[0].radiance[at] / coarse.pictures.constant.radiance[at];
      changed = std::max(changed, std::abs(pixels.radiance[1][at] / unit - was));
    }
  EXPECT_LT(worst, 1e-4);
  EXPECT_GT(changed, 20.0 * 1e-4);  // there was something to correct
}

}  // namespace
}  // namespace opaline::reconstruct
