#include "bench/led/map_time.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "base/ensure.h"
#include "base/light_sphere.h"
#include "base/stage_record.h"
#include "bench/figure.h"
#include "bench/led/ball_case.h"
#include "bench/stopwatch.h"
#include "capture/stage_patterns.h"
#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/stage_correction.h"

namespace opaline::bench {
namespace {

using reconstruct::BallTable;
using reconstruct::LeftOut;

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

/// Ten megapixels of a ball, four fifths of its diameter high.
sim::BallScene large_ball(double noise) {
  sim::BallScene scene;
  scene.noise = noise;
  scene.pixel_mm = 1.6 * scene.radius_mm / 3163.0;
  return scene;
}

/// Maps, and what an optimiser would take for those of their pixels that have an answer.
void measure_maps(const char* which, double noise, ThreadTeam& team) {
  constexpr int kRounds = 3;
  const sim::BallScene scene = large_ball(noise);
  const auto [reflectance, ratio] = BallTable::standard().light(scene.reduced_albedo, 0.15);
  const auto pictures = pictures_of(scene, sim::draw_ball(scene, {reflectance, 0.0, ratio, 0.0}));
  std::vector<double> seconds;
  double found = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const Stopwatch watch;
    const auto maps = *reconstruct::estimate_scattering(pictures, BallTable::standard(), {}, team);
    seconds.push_back(watch.seconds());
    found = static_cast<double>(std::ranges::count(maps.left_out, LeftOut::kFound));
  }
  const double taken = median(seconds);
  const auto measured =
      static_cast<double>(std::ranges::count(pictures.measured, reconstruct::kMeasured));
  print_figure("led.map_share_found", which, found / measured, "1");
  print_figure("led.map_seconds_10mp", which, taken, "s");
  const double optimiser =
      seconds_of_optimiser(BallTable::standard(), reflectance, ratio) * found / team.size();
  print_figure("led.optimiser_seconds_10mp", which, optimiser, "s");
  print_figure("led.optimiser_ratio", which, optimiser / taken, "x");
}

/// What comes before the maps in a sphere of 156 lamps. The pictures are ideal ones already, which costs the same.
void measure_correction(ThreadTeam& team) {
  const sim::BallScene scene = large_ball(0.01);
  const auto [reflectance, ratio] = BallTable::standard().light(scene.reduced_albedo, 0.15);
  auto drawn = sim::draw_ball(scene, {reflectance, 0.0, ratio, 0.0});
  StageRecord stage;
  stage.lights = light_sphere(156, 600.0, 1.0);
  stage.pixel_mm = scene.pixel_mm;
  stage.middle_x = 0.5 * drawn.width;
  stage.middle_y = 0.5 * drawn.height;
  stage.distance_mm = 1000.0;
  const auto patterns = capture::stage_patterns(stage.lights, stage.axes, {.specular = false});
  ENSURE(patterns);
  reconstruct::StagePictures pictures;
  pictures.width = drawn.width;
  pictures.height = drawn.height;
  pictures.measured = std::move(drawn.measured);
  pictures.constant = {
      std::move(drawn.radiance[0]), std::move(drawn.variance[0]), (*patterns)[0].codes};
  for (std::size_t a = 0; a < 3; ++a)
    pictures.gradients[a] = {std::move(drawn.radiance[a + 1]),
                             std::move(drawn.variance[a + 1]),
                             (*patterns)[a + 1].codes};
  const Stopwatch watch;
  const auto ideal = reconstruct::ideal_pictures(pictures, stage, 1.4, team);
  const double seconds = watch.seconds();
  ENSURE(ideal);
  print_figure("led.correction_seconds_10mp", "156 lamps", seconds, "s");
}

}  // namespace

void measure_time(ThreadTeam& team) {
  measure_maps("ball", 0.01, team);
  measure_maps("ball, windows of few pixels", 1e-4, team);
  measure_correction(team);
}

}  // namespace opaline::bench
