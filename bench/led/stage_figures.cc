#include "bench/led/stage_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>

#include "bench/figure.h"
#include "bench/led/stage_case.h"

namespace opaline::bench {
namespace {

void print_reasons(const std::string& which, const StageErrors& e) {
  for (std::size_t reason = 1; reason < e.reasons.size(); ++reason) {
    if (!(e.reasons[reason] > 0.0)) continue;
    const auto why = reconstruct::to_string(static_cast<reconstruct::LeftOut>(reason));
    print_figure("led.share_left_out", fmt::format("{}, {}", which, why), e.reasons[reason], "1");
  }
}

void print_errors(const std::string& which, const StageErrors& e) {
  print_figure("led.diffusion_error_mc", which, e.error_90, "1");
  print_figure("led.scattering_error_mc", which, e.scattering_error_90, "1");
  print_figure("led.albedo_error_mc", which, e.albedo_error, "1");
  print_figure("led.stage_diffusion_bias", which, e.bias, "1");
  print_figure("led.stage_diffusion_error", which, e.error, "1");
  print_figure("led.coverage_2sigma", which, e.coverage, "1");
  print_figure("led.stated_deviation", which, e.stated, "1");
  print_figure("led.share_found", which, e.found, "1");
  print_figure("led.normal_error_deg", which, e.normal_deg, "degrees");
  print_figure("led.normal_error_deg", which + ", answered", e.answered_normal_deg, "degrees");
  print_reasons(which, e);
}

/// Shares of the pixels that have an answer, and that have a wrong one: beyond two stated deviations.
void print_extreme(const std::string& which, const StageErrors& e) {
  print_figure("led.extreme_found", which, e.found, "1");
  print_figure("led.extreme_wrong", which, e.wrong, "1");
  print_figure(
      "led.extreme_bias_over_stated", which, e.stated > 0.0 ? e.bias / e.stated : 0.0, "1");
  print_reasons(which, e);
}

/// All that is believed of lamps and white target drawn from, not only the camera's noise: what a stated deviation is about.
void measure_draws(StageScene scene, ThreadTeam& team) {
  constexpr int kDraws = 6;
  const StageShot usual;
  scene.paths /= 3;
  scene.intensity_error = usual.lamp_deviation;
  double coverage = 0.0;
  for (int draw = 1; draw <= kDraws; ++draw) {
    scene.seed = static_cast<std::uint64_t>(draw);
    std::mt19937_64 random(scene.seed);
    StageShot shot;
    shot.noise_seed = scene.seed;
    shot.white_error = std::normal_distribution<double>(0.0, usual.white_deviation)(random);
    const StageErrors e = StageCase(scene).run(shot, team);
    print_errors(fmt::format("stage, 4 frames, lamps and white as believed, draw {}", draw), e);
    coverage += e.coverage / kDraws;
  }
  print_figure("led.coverage_2sigma", "stage, 4 frames, mean of the draws", coverage, "1");
}

}  // namespace

void measure_stage(ThreadTeam& team, std::int64_t paths) {
  StageScene scene;
  scene.paths = paths;
  const StageCase stage(scene);
  print_errors("stage, 4 frames", stage.run({}, team));
  measure_draws(scene, team);
  StageShot halves;
  halves.split = true;
  const StageErrors shifted = stage.run({}, team);
  const StageErrors split = stage.run(halves, team);
  print_figure("led.shifted_less_split", "ln D, median", shifted.bias - split.bias, "1");
  print_figure("led.shifted_less_split", "one stated deviation", shifted.stated, "1");
}

void measure_blobs(ThreadTeam& team, std::int64_t paths_per_pixel, const std::string& only) {
  for (const auto& [body, radius] : {std::pair{"ball", 10.0},
                                     {"blob_a", 10.0},
                                     {"blob_b", 10.0},
                                     {"blob_c", 10.0},
                                     {"blob_d", 8.0},
                                     {"dent", 8.0}}) {
    if (!only.empty() && only != body) continue;
    StageScene scene;
    scene.body = body;
    scene.seed = 7;
    scene.radii_mm = {radius};
    scene.paths_per_pixel = paths_per_pixel;
    const StageCase stage(scene);
    StageShot shot;
    shot.frames = 1'000'000;
    print_errors(fmt::format("{}, noise-free", body), stage.run(shot, team));
    print_errors(body, stage.run({}, team));
  }
}

void measure_extremes(ThreadTeam& team, std::int64_t paths) {
  StageScene ordinary;
  ordinary.radii_mm = {8.0};
  ordinary.paths = paths;
  const StageCase stage(ordinary);
  print_extreme("ordinary", stage.run({}, team));
  StageShot shot;
  shot.clip = 0.8;
  print_extreme("one saturated picture", stage.run(shot, team));
  for (const auto& [which, albedo] : {std::pair{"reduced albedo 0.5", 0.5},
                                      {"reduced albedo 0.8", 0.8},
                                      {"reduced albedo 0.999", 0.999},
                                      {"reduced albedo 0.9999", 0.9999}}) {
    StageScene scene = ordinary;
    scene.reduced_albedo = albedo;
    if (albedo > 0.99) scene.paths = std::min<std::int64_t>(paths, 50'000);
    print_extreme(which, StageCase(scene).run({}, team));
  }
  for (const auto& [which, ior] :
       {std::pair{"index 1.3 for 1.4 +- 0.1", 1.3}, {"index 1.5 for 1.4 +- 0.1", 1.5}}) {
    StageScene scene = ordinary;
    scene.ior = ior;
    shot = {};
    shot.ior_deviation = 0.1;
    print_extreme(which, StageCase(scene).run(shot, team));
  }
  StageScene dead = ordinary;
  dead.paths = std::min<std::int64_t>(paths, 100'000);
  for (const auto& [which, way] : {std::pair{"dead lamp above", Vec3{0, 1, 0}},
                                   {"dead lamp in front", Vec3{0, 0, 1}},
                                   {"dead lamp aside, in front", Vec3{0.7, 0, 0.7}},
                                   {"dead lamp behind", Vec3{0, 0, -1}}}) {
    dead.dead_lamps = {lamp_towards(dead.lamps, way)};
    dead.dead_are_known = false;
    print_extreme(fmt::format("{}, unknown", which), StageCase(dead).run({}, team));
    dead.dead_are_known = true;
    print_extreme(fmt::format("{}, found by the lamp check", which), StageCase(dead).run({}, team));
  }
  StageScene uneven = ordinary;
  uneven.intensity_error = 0.03;
  shot = {};
  shot.lamp_deviation = 0.03;
  print_extreme("lamps off by 3 %, as is believed", StageCase(uneven).run(shot, team));
}

}  // namespace opaline::bench
