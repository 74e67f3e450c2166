#include "bench/led/stage_case.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "base/ensure.h"
#include "bench/stopwatch.h"
#include "capture/stage_patterns.h"
#include "drivers/stage_picture.h"

namespace opaline::bench {
namespace {

using reconstruct::BallTable;
using reconstruct::LeftOut;
using reconstruct::StagePictures;

constexpr double kFullWell = 30'000.0;
constexpr double kFilled = 0.9;
constexpr double kReadNoise = 3.0;
constexpr double kSettle = 0.25;  // s, a pattern
constexpr int kEdge = 2;          // pixels along the outline that are left out

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

int lamp_towards(int lamps, Vec3 direction) {
  const auto all = light_sphere_directions(lamps);
  const auto nearest = std::ranges::max_element(all, {}, [&](Vec3 d) { return dot(d, direction); });
  return static_cast<int>(nearest - all.begin());
}

StageCase::StageCase(const StageScene& scene) : scene_(scene) {
  sim::LedSphereOptions options;
  options.radii_mm = scene.radii_mm;
  options.reduced_albedo = {scene.reduced_albedo, scene.reduced_albedo, scene.reduced_albedo};
  options.translucency_mm = {scene.translucency_mm, scene.translucency_mm, scene.translucency_mm};
  options.ior = scene.ior;
  options.paths = scene.paths;
  options.dead_lights = scene.dead_lamps;
  options.intensity_error = scene.intensity_error;
  options.seed = scene.seed;
  options.body = scene.body;
  options.paths_per_pixel = scene.paths_per_pixel;
  options.mixture = scene.mixture;
  options.second_reduced_albedo.fill(scene.second_reduced_albedo);
  options.second_translucency_mm.fill(scene.second_translucency_mm);
  truth_ = *sim::LedTruth::create(options);
  const auto balls = sim::balls_of(options);
  const auto& blob = truth_->blob();
  const double right = blob ? blob->outer_mm() : balls.back().centre.x + balls.back().radius_mm;
  const double tall = blob ? blob->outer_mm() : *std::ranges::max_element(scene.radii_mm);
  CameraModel& model = camera_.model;
  model.width = 2 * static_cast<int>(right / scene.pixel_mm + 8.0);
  model.height = 2 * static_cast<int>(tall / scene.pixel_mm + 8.0);
  model.fx = model.fy = 1000.0 / scene.pixel_mm;
  model.cx = 0.5 * model.width;
  model.cy = 0.5 * model.height;
  model.distortion = {};
  model.camera_from_sample = look_at({0, 0, 1000}, {0, 0, 0}, {0, 1, 0});
  record_.lights = light_sphere(scene.lamps, 600.0, 1.0);
  record_.middle_x = model.cx;
  record_.middle_y = model.cy;
  record_.pixel_mm = scene.pixel_mm;
  record_.distance_mm = 1000.0;
  NullSink events;
  auto made = sim::make_led_object(options, record_.lights, camera_, events, {});
  ENSURE(made);
  sphere_ = *std::move(made);
  if (const auto* traced = dynamic_cast<const sim::LedBlob*>(sphere_.get()))
    path_noise_ = traced->path_noise();
  for (const int dead : scene.dead_lamps)
    if (scene.dead_are_known) record_.lights[static_cast<std::size_t>(dead)].intensity = 0.0;
}

double StageCase::diffusion() const {
  return sim::diffusion_of(scene_.reduced_albedo, scene_.translucency_mm);
}

std::vector<float> StageCase::light(const std::vector<std::uint8_t>& codes) const {
  const Image<float> seen =
      sphere_->light(drivers::stage_picture({1, codes}).codes).sensor_radiance;
  std::vector<float> green;
  for (std::size_t at = 0; at < seen.pixel_count(); ++at)
    green.push_back(seen.samples()[3 * at + 1]);
  return green;
}

StagePictures StageCase::photograph(const StageShot& shot) const {
  const auto patterns = capture::stage_patterns(
      record_.lights, record_.axes, {.split = shot.split, .specular = false});
  ENSURE(patterns);
  StagePictures p;
  p.width = camera_.model.width;
  p.height = camera_.model.height;
  std::mt19937_64 random(shot.noise_seed);
  std::normal_distribution<double> gaussian(0.0, 1.0);
  std::vector<StagePictures::Picture> constants;
  std::vector<std::uint8_t> clipped(static_cast<std::size_t>(p.width) * p.height, 0);
  for (const capture::StageLight& pattern : *patterns) {
    StagePictures::Picture picture{{}, {}, pattern.codes};
    std::vector<float> clean = light(pattern.codes);
    for (float& l : clean) l *= static_cast<float>(1.0 + shot.white_error);
    const double brightest = *std::ranges::max_element(clean);
    const double per_electron = brightest / (kFilled * kFullWell);
    for (std::size_t at = 0; at < clean.size(); ++at) {
      const double electrons = clean[at] / per_electron;
      const double variance =
          (electrons + kReadNoise * kReadNoise) / shot.frames * per_electron * per_electron;
      picture.radiance.push_back(
          static_cast<float>(clean[at] + std::sqrt(variance) * gaussian(random)));
      const double of_paths = path_noise_ * clean[at];
      picture.variance.push_back(static_cast<float>(variance + of_paths * of_paths));
      if (shot.clip > 0.0 && pattern.name == "gradient_x" && clean[at] > shot.clip * brightest)
        clipped[at] = 1;
    }
    if (pattern.name.starts_with("constant")) {
      constants.push_back(std::move(picture));
    } else if (pattern.name.ends_with("_minus")) {
      p.minuses.push_back(std::move(picture));
    } else {
      p.gradients[static_cast<std::size_t>(pattern.name[9] - 'x')] = std::move(picture);
    }
  }
  p.constant = constants[0];
  for (std::size_t at = 0; at < p.constant.radiance.size(); ++at) {
    p.constant.radiance[at] = 0.5F * (constants[0].radiance[at] + constants[1].radiance[at]);
    p.constant.variance[at] = 0.25F * (constants[0].variance[at] + constants[1].variance[at]);
  }
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      bool inside = true;
      for (const auto& [dx, dy] : {std::pair{-kEdge, 0}, {kEdge, 0}, {0, -kEdge}, {0, kEdge}})
        inside = inside && truth_->at(camera_.model, x + 0.5 + dx, y + 0.5 + dy).has_value();
      const std::size_t at = static_cast<std::size_t>(y) * p.width + x;
      p.measured.push_back(!inside            ? reconstruct::kNotSeen
                           : clipped[at] != 0 ? reconstruct::kClipped
                                              : reconstruct::kMeasured);
    }
  return p;
}

reconstruct::ScatteringMaps StageCase::estimate(const StagePictures& pictures,
                                                const StageShot& shot,
                                                ThreadTeam& team) const {
  const auto table = BallTable::of_index(shot.ior);
  const auto lower = BallTable::of_index(std::max(1.3, shot.ior - shot.ior_deviation));
  const auto higher = BallTable::of_index(std::min(1.5, shot.ior + shot.ior_deviation));
  ENSURE(table && lower && higher);
  reconstruct::MapOptions options;
  options.half_windows.clear();
  for (int half = 2; half <= shot.largest_window; half *= 2) options.half_windows.push_back(half);
  options.shared =
      reconstruct::shared_deviations(shot.lamp_deviation, scene_.lamps, shot.white_deviation);
  options.ior = shot.ior;
  if (shot.ior_deviation > 0.0) {
    options.lower_index = &*lower;
    options.higher_index = &*higher;
  }
  const auto ideal = reconstruct::ideal_pictures(pictures, record_, shot.ior, team);
  ENSURE(ideal);
  auto maps = reconstruct::estimate_scattering(*ideal, *table, options, team);
  ENSURE(maps);
  return *std::move(maps);
}

StageErrors StageCase::errors(const StagePictures& pictures,
                              const reconstruct::ScatteringMaps& maps) const {
  StageErrors e;
  std::vector<double> offs;
  std::vector<double> stated;
  std::vector<double> relative;
  std::vector<double> scattered;
  double pixels = 0.0;
  for (int y = 0; y < maps.height; ++y)
    for (int x = 0; x < maps.width; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * maps.width + x;
      const auto seen = truth_->at(camera_.model, x + 0.5, y + 0.5);
      if (pictures.measured[at] == reconstruct::kNotSeen || !seen) continue;
      pixels += 1.0;
      e.reasons[static_cast<std::size_t>(maps.left_out[at])] += 1.0;
      const Vec3 n = seen->normal;
      const double cosine =
          n.x * maps.normal_x[at] - n.y * maps.normal_y[at] + n.z * maps.normal_z[at];
      const double degrees = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
      if (pictures.measured[at] == reconstruct::kMeasured) e.normal_deg += degrees;
      if (maps.left_out[at] != LeftOut::kFound) continue;
      e.answered_normal_deg += degrees;
      const double off = std::log(maps.diffusion[at] / seen->diffusion_mm[1]);
      const double scattering = seen->reduced_albedo[1] / (3.0 * seen->diffusion_mm[1]);
      relative.push_back(std::abs(std::expm1(off)));
      scattered.push_back(std::abs(maps.reduced_scattering[at] / scattering - 1.0));
      offs.push_back(off);
      stated.push_back(maps.log_diffusion_deviation[at]);
      e.error += off * off;
      e.albedo_error += std::abs(maps.reduced_albedo[at] / seen->reduced_albedo[1] - 1.0);
      (std::abs(off) < 2.0 * stated.back() ? e.coverage : e.wrong) += 1.0;
    }
  const double found = std::max<double>(1.0, static_cast<double>(offs.size()));
  e.error = std::sqrt(e.error / found);
  e.albedo_error /= found;
  e.coverage /= found;
  e.answered_normal_deg /= found;
  e.wrong /= pixels;
  e.found = static_cast<double>(offs.size()) / pixels;
  e.normal_deg /= std::max(1.0, pixels - e.reasons[static_cast<std::size_t>(LeftOut::kSaturated)]);
  for (double& share : e.reasons) share /= pixels;
  e.bias = quantile(std::move(offs), 0.5);
  e.stated = quantile(std::move(stated), 0.5);
  e.error_90 = quantile(std::move(relative), 0.9);
  e.scattering_error_90 = quantile(std::move(scattered), 0.9);
  return e;
}

StageErrors StageCase::run(const StageShot& shot, ThreadTeam& team) const {
  const StagePictures pictures = photograph(shot);
  const Stopwatch watch;
  const auto maps = estimate(pictures, shot, team);
  const double seconds = watch.seconds();
  StageErrors e = errors(pictures, maps);
  e.seconds = seconds;
  return e;
}

double StageCase::capture_seconds(const StageShot& shot) const {
  const auto patterns = capture::stage_patterns(
      record_.lights, record_.axes, {.split = shot.split, .specular = false});
  double seconds = 0.0;
  for (const capture::StageLight& pattern : *patterns) {
    const std::vector<float> clean = light(pattern.codes);
    const double rate = camera_.sensitivity[1] * *std::ranges::max_element(clean);
    seconds += kSettle + shot.frames * kFilled * kFullWell / rate;
  }
  return seconds;
}

}  // namespace opaline::bench
