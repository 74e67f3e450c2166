#include "bench/led/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "bench/figure.h"
#include "bench/front.h"
#include "bench/led/stage_case.h"
#include "bench/stopwatch.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/curvature_ratio.h"
#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::bench {
namespace {

using reconstruct::CurvatureRatio;
using reconstruct::StagePictures;

constexpr double kIor = 1.4;

/// How D is had from a window's reflectance, ratio and curvature.
enum class Formula : std::uint8_t { kDipole, kPublished };

/// Root mean square of ln D over the truth, a formula put where the table is; in windows of one size, over the pixels with an answer.
double formula_error(const StageCase& stage,
                     const StagePictures& pictures,
                     int half,
                     Formula formula,
                     ThreadTeam& team) {
  const auto ideal = *reconstruct::ideal_pictures(pictures, stage.record(), kIor, team);
  const CurvatureRatio model = *CurvatureRatio::make(kIor);
  const double inside = reconstruct::diffusion::internal_moments(kIor).fluence;
  const double a = (1.0 + inside) / (1.0 - inside);
  reconstruct::PixelValues values(ideal.width, ideal.height, team);
  for (std::size_t at = 0; at < ideal.measured.size(); ++at) {
    if (ideal.measured[at] != reconstruct::kMeasured) continue;
    std::array<double, 3> gradient{};
    double square = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      gradient[k] = 2.0 * ideal.radiance[k + 1][at] - ideal.radiance[0][at];
      square += gradient[k] * gradient[k];
    }
    const double length = std::sqrt(square);
    values.normal_x[at] = static_cast<float>(gradient[0] / length);
    values.normal_y[at] = static_cast<float>(gradient[1] / length);
    values.ratio[at] = static_cast<float>(ideal.radiance[0][at] / length);
    values.reflectance[at] = static_cast<float>(ideal.radiance[0][at] / ideal.white);
    values.measured[at] = 1;
  }
  std::vector<double> squares(values.measured.size(), -1.0);
  reconstruct::for_each_window(
      values, half, team, [&](int x, int y, const reconstruct::WindowValues& w) {
        const double curvature = w.curvature / ideal.pixel_mm;
        const auto albedo = model.reduced_albedo(std::clamp<double>(w.reflectance, 0.0, 1.0));
        if (w.count < 6 || !(curvature > 0.0) || !albedo) return;
        const auto bend = model.bend(*albedo, w.ratio);
        const double found = formula == Formula::kDipole
                                 ? (bend ? *bend / curvature : 0.0)
                                 : reconstruct::as_published::diffusion(
                                       *albedo, reconstruct::shifted_ratio(w.ratio), curvature, a);
        if (found > 0.0)
          squares[values.index(x, y)] = std::pow(std::log(found / stage.diffusion()), 2);
      });
  double sum = 0.0;
  double count = 0.0;
  for (const double square : squares) {
    if (square < 0.0) continue;
    sum += square;
    count += 1.0;
  }
  return std::sqrt(sum / std::max(1.0, count));
}

}  // namespace

int measure_tradeoff(std::int64_t paths, const std::string& plot, ThreadTeam& team) {
  std::vector<FrontPoint> points;
  const auto add = [&](FrontPoint point) {
    print_figure("led.tradeoff_error", point.name, point.error, "1");
    print_figure("led.tradeoff_seconds", point.name, point.seconds, "s");
    points.push_back(std::move(point));
  };
  for (const int lamps : {346, 156, 60}) {
    StageScene scene;
    scene.lamps = lamps;
    scene.paths = paths;
    const StageCase stage(scene);
    for (const int frames : {1, 4, 16}) {
      StageShot shot;
      shot.frames = frames;
      const double capture = stage.capture_seconds(shot);
      const StagePictures pictures = stage.photograph(shot);
      const std::string with = fmt::format("{} lamps, {} frames", lamps, frames);
      for (const int window : {4, 8, 16, 32}) {
        shot.largest_window = window;
        const Stopwatch watch;
        const auto maps = stage.estimate(pictures, shot, team);
        const double seconds = capture + watch.seconds();
        add({fmt::format("{}, window {}, table", with, window),
             fmt::format("{} lamps", lamps),
             seconds,
             stage.errors(pictures, maps).error});
      }
      for (const auto& [name, formula] :
           {std::pair{"dipole", Formula::kDipole}, {"as published", Formula::kPublished}}) {
        const Stopwatch watch;
        const double error = formula_error(stage, pictures, 16, formula, team);
        add({fmt::format("{}, window 16, {}", with, name),
             "formulas",
             capture + watch.seconds(),
             error});
      }
    }
  }
  for (const FrontPoint& point : front_of(points))
    print_figure("led.tradeoff_front", point.name, point.error, "1");
  if (plot.empty()) return 0;
  const auto drawn = draw_front(points, "capture and computing, s", "error of D, %", plot);
  if (drawn) return 0;
  std::fputs((drawn.error().message + "\n").c_str(), stderr);
  return 1;
}

}  // namespace opaline::bench
