// Scattering parameters of curved surfaces from four pictures (Zhu et al. 2013): how far the formulas, the paper's own and the table of
// traced balls are from balls traced anew, whether the stated deviations hold, and how long the maps of ten megapixels take.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <string>
#include <thread>
#include <utility>

#include "bench/figure.h"
#include "bench/led/blob_case.h"
#include "bench/led/stage_case.h"
#include "bench/led/tradeoff.h"
#include "bench/stopwatch.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/beam_fit.h"
#include "reconstruct/spherical_gradient/curvature_ratio.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "sim/ball_beam.h"
#include "sim/ball_pictures.h"

namespace opaline::bench {
namespace {

using reconstruct::BallTable;
using reconstruct::CurvatureRatio;
using reconstruct::LeftOut;

constexpr double kIor = 1.4;

struct Material {
  const char* name;
  double reduced_albedo;
  double curvature;  ///< k l_d
};
/// sigma_s' and sigma_a (1/mm) of the usual tables, green: skin 1.0 / 0.07, marble 2.6 / 0.0041 (Jensen et al. 2001), on balls of 4 to 20 mm; wax and
/// stone made up.
constexpr std::array kMaterials{Material{"skin", 0.9346, 0.2},
                                Material{"wax", 0.985, 0.3},
                                Material{"marble", 0.9984, 0.4},
                                Material{"stone", 0.88, 0.06},
                                Material{"stone, bent", 0.88, 0.35}};

double decay(double reduced_albedo) { return std::sqrt(3.0 * (1.0 - reduced_albedo)); }

void measure_formulas() {
  const CurvatureRatio model = *CurvatureRatio::make(kIor);
  double round_trip = 0.0;
  double cosine = 0.0;
  for (const double albedo : {0.9, 0.95, 0.99, 0.999})
    for (const double translucency : {0.5, 1.0, 2.0, 4.0})
      for (const double radius : {5.0, 10.0, 15.0}) {
        const double bend = decay(albedo) * translucency / 3.0 / radius;
        const double ratio = model.ratio(albedo, bend);
        if (std::isfinite(ratio))
          round_trip = std::max(round_trip, std::abs(*model.bend(albedo, ratio) / bend - 1.0));
        if (translucency > 0.4 * radius) continue;
        const double integral = model.ratio_by_quadrature(albedo, bend);
        cosine = std::max(cosine, std::abs(*model.bend(albedo, integral) / bend - 1.0));
      }
  print_figure("led.round_trip_error", "formula", round_trip, "1");
  print_figure("led.round_trip_error", "cosine integral", cosine, "1");
}

void measure_materials(ThreadTeam& team, std::int64_t paths) {
  const CurvatureRatio model = *CurvatureRatio::make(kIor);
  const double inside = reconstruct::diffusion::internal_moments(kIor).fluence;
  const double a = (1.0 + inside) / (1.0 - inside);
  double worst_diffusion = 0.0;
  double worst_albedo = 0.0;
  for (const Material& m : kMaterials) {
    const double bend = decay(m.reduced_albedo) * m.curvature / 3.0;
    const auto light = *sim::trace_ball(
        {m.reduced_albedo, 1.0 / (decay(m.reduced_albedo) * m.curvature), kIor}, paths, 99, team);
    const BallTable::Found found = BallTable::standard().find(light.reflectance, light.ratio);
    const double found_bend = decay(found.reduced_albedo) * found.curvature / 3.0;
    const double diffusion_error =
        found.end == BallTable::End::kFound ? std::abs(found_bend / bend - 1.0) : 1.0;
    const double albedo_error = std::abs(found.reduced_albedo / m.reduced_albedo - 1.0);
    print_figure("led.diffusion_error_mc", m.name, diffusion_error, "1");
    print_figure("led.albedo_error_mc", m.name, albedo_error, "1");
    const double dipole_albedo = *model.reduced_albedo(light.reflectance);
    const auto dipole = model.bend(dipole_albedo, light.ratio);
    print_figure("led.diffusion_over_truth_dipole", m.name, dipole ? *dipole / bend : 0.0, "1");
    const double shifted = reconstruct::shifted_ratio(light.ratio);
    const double curvature = 0.1;
    print_figure("led.diffusion_over_truth_published",
                 m.name,
                 reconstruct::as_published::diffusion(dipole_albedo, shifted, curvature, a) *
                     curvature / bend,
                 "1");
    print_figure(
        "led.diffusion_over_truth_linear",
        m.name,
        reconstruct::as_published::linear_diffusion(light.reflectance, shifted, curvature) *
            curvature / bend,
        "1");
    worst_diffusion = std::max(worst_diffusion, diffusion_error);
    worst_albedo = std::max(worst_albedo, albedo_error);
  }
  print_figure("led.diffusion_error_mc", "worst", worst_diffusion, "1");
  print_figure("led.albedo_error_mc", "worst", worst_albedo, "1");
}

/// The reference method of the paper's Table 1 on the same balls: a dipole fitted to what a thin beam makes leave, from 2 mean free paths to 8 l_d away.
void measure_beams(ThreadTeam& team, std::int64_t paths) {
  for (const Material& m : kMaterials) {
    const double g = decay(m.reduced_albedo);
    const double radius = 1.0 / (g * m.curvature);  // mean free paths
    const double reach = std::min(8.0 / g, 1.2 * radius);
    const auto beam =
        sim::trace_beam({m.reduced_albedo, radius, kIor}, reach, 60, paths, 21, team, {});
    if (!beam) continue;
    std::vector<double> distance;
    std::vector<double> exitance;
    std::vector<double> weight;
    for (std::size_t n = 0; n < beam->distance.size(); ++n) {
      if (beam->distance[n] < 2.0 || !(beam->exitance[n] > 0.0)) continue;
      distance.push_back(beam->distance[n]);
      exitance.push_back(beam->exitance[n] / (1.0 - std::pow((kIor - 1.0) / (kIor + 1.0), 2)));
      const double noise = beam->deviation[n] / beam->exitance[n];
      weight.push_back(1.0 / (noise * noise + 1e-4));
    }
    const auto found = reconstruct::fit_beam(distance, exitance, weight, kIor);
    if (!found) continue;
    print_figure("led.beam_diffusion_over_truth", m.name, 3.0 * found->diffusion, "1");
    print_figure("led.beam_translucency_over_truth", m.name, found->translucency * g, "1");
  }
}

reconstruct::GradientPictures pictures_of(const sim::BallScene& scene,
                                          const sim::BallPictures& drawn) {
  return {drawn.width,
          drawn.height,
          scene.pixel_mm,
          scene.white,
          drawn.radiance,
          drawn.variance,
          drawn.measured};
}

void measure_noise(ThreadTeam& team, std::int64_t paths) {
  sim::BallScene scene;
  const sim::BallLight light = *sim::trace_ball(scene.ball(), paths, 101, team);
  scene.noise = 0.01;
  double inside = 0.0;
  double found = 0.0;
  double degrees = 0.0;
  double seen = 0.0;
  for (scene.seed = 1; scene.seed <= 8; ++scene.seed) {
    const sim::BallPictures drawn = sim::draw_ball(scene, light);
    const auto maps = *reconstruct::estimate_scattering(
        pictures_of(scene, drawn), BallTable::standard(), {}, team);
    for (std::size_t at = 0; at < maps.left_out.size(); ++at) {
      if (drawn.measured[at] == 0) continue;
      const double nx = drawn.normal_x[at];
      const double ny = drawn.normal_y[at];
      const double cosine = nx * maps.normal_x[at] + ny * maps.normal_y[at] +
                            std::sqrt(1.0 - nx * nx - ny * ny) * maps.normal_z[at];
      degrees += std::acos(std::min(1.0, cosine)) * 180.0 / std::numbers::pi;
      seen += 1.0;
      if (maps.left_out[at] != LeftOut::kFound) continue;
      const double off = std::log(maps.diffusion[at] / scene.diffusion());
      inside += std::abs(off) < 2.0 * maps.log_diffusion_deviation[at] ? 1.0 : 0.0;
      found += 1.0;
    }
  }
  print_figure("led.coverage_2sigma", "1 % noise", inside / found, "1");
  print_figure("led.share_found", "1 % noise", found / seen, "1");
  print_figure("led.normal_error_deg", "1 % noise", degrees / seen, "degrees");
}

/// Nelder and Mead's simplex on the table, as a per-pixel optimiser would: seconds a pixel.
double seconds_of_optimiser(const BallTable& table, double reflectance, double ratio) {
  constexpr int kPixels = 2000;
  const Stopwatch watch;
  double sum = 0.0;
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    const double wanted = ratio * (1.0 + 1e-6 * pixel);
    const auto misfit = [&](const std::array<double, 2>& at) {
      const double albedo = 1.0 - std::exp(2.0 * at[0]) / 3.0;
      const BallTable::Light light = table.light(albedo, at[1]);
      return std::pow(light.reflectance / reflectance - 1.0, 2) +
             std::pow(light.ratio / wanted - 1.0, 2);
    };
    using Vertex = std::pair<double, std::array<double, 2>>;
    std::array<Vertex, 3> simplex;
    const std::array<std::array<double, 2>, 3> starts{{{-1.0, 0.1}, {-1.5, 0.1}, {-1.0, 0.2}}};
    for (std::size_t n = 0; n < 3; ++n) simplex[n] = {misfit(starts[n]), starts[n]};
    for (int step = 0; step < 200; ++step) {
      std::sort(simplex.begin(), simplex.end());
      if (simplex[0].first < 1e-12) break;
      const auto& low = simplex[0].second;
      const auto& next = simplex[1].second;
      auto& worst = simplex[2];
      const auto along = [&](double t) {
        std::array<double, 2> at{};
        for (std::size_t d = 0; d < 2; ++d) {
          const double middle = 0.5 * (low[d] + next[d]);
          at[d] = middle + t * (worst.second[d] - middle);
        }
        return Vertex{misfit(at), at};
      };
      Vertex trial = along(-1.0);
      if (trial.first < simplex[0].first) {
        const Vertex further = along(-2.0);
        trial = std::min(trial, further);
      } else if (trial.first >= simplex[1].first) {
        trial = along(trial.first < worst.first ? -0.5 : 0.5);
      }
      if (trial.first < worst.first) {
        worst = trial;
        continue;
      }
      for (std::size_t n = 1; n < 3; ++n) {
        for (std::size_t d = 0; d < 2; ++d)
          simplex[n].second[d] = 0.5 * (simplex[n].second[d] + low[d]);
        simplex[n].first = misfit(simplex[n].second);
      }
    }
    sum += simplex[0].second[1];
  }
  if (!std::isfinite(sum)) std::fputs("the simplex diverged\n", stderr);
  return watch.seconds() / kPixels;
}

void measure_time(ThreadTeam& team) {
  sim::BallScene scene;
  scene.noise = 0.01;
  scene.pixel_mm = 1.6 * scene.radius_mm / 3163.0;  // ten megapixels
  const auto [reflectance, ratio] = BallTable::standard().light(scene.reduced_albedo, 0.15);
  const auto pictures = pictures_of(scene, sim::draw_ball(scene, {reflectance, 0.0, ratio, 0.0}));
  std::vector<double> seconds;
  double found = 0.0;
  for (int round = 0; round < 3; ++round) {
    const Stopwatch watch;
    const auto maps = *reconstruct::estimate_scattering(pictures, BallTable::standard(), {}, team);
    seconds.push_back(watch.seconds());
    found = static_cast<double>(std::ranges::count(maps.left_out, LeftOut::kFound));
  }
  const double taken = median(seconds);
  print_figure("led.map_seconds_10mp", "ball", taken, "s");
  const double optimiser =
      seconds_of_optimiser(BallTable::standard(), reflectance, ratio) * found / team.size();
  print_figure("led.optimiser_seconds_10mp", "ball", optimiser, "s");
  print_figure("led.optimiser_ratio", "ball", optimiser / taken, "x");
}

/// Balls in a sphere of 156 lamps, photographed by a camera: what a session reaches.
void measure_stage(ThreadTeam& team, std::int64_t paths) {
  StageScene scene;
  scene.paths = paths;
  const StageCase stage(scene);
  StageErrors mean;
  constexpr int kRounds = 4;
  for (int round = 1; round <= kRounds; ++round) {
    StageShot shot;
    shot.noise_seed = static_cast<std::uint64_t>(round);
    const StageErrors e = stage.run(shot, team);
    mean.bias += e.bias / kRounds;
    mean.error += e.error / kRounds;
    mean.coverage += e.coverage / kRounds;
    mean.found += e.found / kRounds;
    mean.normal_deg += e.normal_deg / kRounds;
    mean.albedo_error += e.albedo_error / kRounds;
  }
  const char* const which = "stage, 4 frames";
  print_figure("led.normal_error_deg", which, mean.normal_deg, "degrees");
  print_figure("led.coverage_2sigma", which, mean.coverage, "1");
  print_figure("led.share_found", which, mean.found, "1");
  print_figure("led.stage_diffusion_bias", which, mean.bias, "1");
  print_figure("led.stage_diffusion_error", which, mean.error, "1");
  print_figure("led.stage_albedo_error", which, mean.albedo_error, "1");
  StageShot halves;
  halves.split = true;
  const StageErrors shifted = stage.run({}, team);
  const StageErrors split = stage.run(halves, team);
  print_figure("led.shifted_less_split", "ln D, median", shifted.bias - split.bias, "1");
  print_figure("led.shifted_less_split", "one stated deviation", shifted.stated, "1");
}

/// Shares of the pixels that have an answer, and that have a wrong one: beyond two stated deviations.
void print_extreme(const char* which, const StageErrors& e) {
  print_figure("led.extreme_found", which, e.found, "1");
  print_figure("led.extreme_wrong", which, e.wrong, "1");
  print_figure(
      "led.extreme_bias_over_stated", which, e.stated > 0.0 ? e.bias / e.stated : 0.0, "1");
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
    print_extreme(fmt::format("{}, unknown", which).c_str(), StageCase(dead).run({}, team));
    dead.dead_are_known = true;
    print_extreme(fmt::format("{}, found by the lamp check", which).c_str(),
                  StageCase(dead).run({}, team));
  }
  StageScene uneven = ordinary;
  uneven.intensity_error = 0.03;
  shot = {};
  shot.lamp_deviation = 0.03;
  print_extreme("lamps off by 3 %, as is believed", StageCase(uneven).run(shot, team));
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  namespace bench = opaline::bench;
  std::int64_t paths = 2'000'000;
  bool tradeoff = false;
  bool blobs = false;
  std::string plot;
  CLI::App app{
      "Scattering parameters from four pictures: errors, coverage, time.\n\nExample: scripts/bench "
      "led_sphere --paths 500000\n  scripts/bench led_sphere --tradeoff --plot /tmp/front.svg"};
  app.add_option("--paths", paths, "A traced ball")->check(CLI::Range(10'000, 1'000'000'000));
  app.add_flag("--tradeoff",
               tradeoff,
               "Only lamps, exposures, smoothing and estimator against error and time");
  app.add_flag("--blobs", blobs, "Only smooth blobs, dents and two materials");
  app.add_option("--plot", plot, "With --tradeoff: an SVG file for the front");
  CLI11_PARSE(app, argc, argv);
  opaline::ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  if (tradeoff) return bench::measure_tradeoff(std::min<std::int64_t>(paths, 500'000), plot, team);
  const std::int64_t a_pixel = std::clamp<std::int64_t>(paths / 4000, 32, 4000);
  if (blobs) {
    bench::measure_blobs(team, a_pixel);
    return 0;
  }
  bench::measure_formulas();
  bench::measure_materials(team, paths);
  bench::measure_beams(team, std::min<std::int64_t>(paths, 500'000));
  bench::measure_noise(team, paths);
  bench::measure_stage(team, std::min<std::int64_t>(paths, 1'000'000));
  bench::measure_blobs(team, a_pixel);
  bench::measure_extremes(team, std::min<std::int64_t>(paths, 300'000));
  bench::measure_time(team);
  return 0;
} catch (const std::exception& error) {
  std::fputs(error.what(), stderr);
  return 1;
}
