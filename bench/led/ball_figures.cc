#include "bench/led/ball_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "bench/figure.h"
#include "bench/led/ball_case.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/beam_fit.h"
#include "reconstruct/spherical_gradient/curvature_ratio.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "sim/ball_beam.h"

namespace opaline::bench {
namespace {

using reconstruct::BallTable;
using reconstruct::CurvatureRatio;
using reconstruct::LeftOut;

constexpr double kBallIor = 1.4;

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

}  // namespace

void measure_formulas() {
  const CurvatureRatio model = *CurvatureRatio::make(kBallIor);
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
  const CurvatureRatio model = *CurvatureRatio::make(kBallIor);
  const double inside = reconstruct::diffusion::internal_moments(kBallIor).fluence;
  const double a = (1.0 + inside) / (1.0 - inside);
  double worst_diffusion = 0.0;
  double worst_albedo = 0.0;
  for (const Material& m : kMaterials) {
    const double bend = decay(m.reduced_albedo) * m.curvature / 3.0;
    const auto light = *sim::trace_ball(
        {m.reduced_albedo, 1.0 / (decay(m.reduced_albedo) * m.curvature), kBallIor},
        paths,
        99,
        team);
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
        sim::trace_beam({m.reduced_albedo, radius, kBallIor}, reach, 60, paths, 21, team, {});
    if (!beam) continue;
    std::vector<double> distance;
    std::vector<double> exitance;
    std::vector<double> weight;
    for (std::size_t n = 0; n < beam->distance.size(); ++n) {
      if (beam->distance[n] < 2.0 || !(beam->exitance[n] > 0.0)) continue;
      distance.push_back(beam->distance[n]);
      exitance.push_back(beam->exitance[n] /
                         (1.0 - std::pow((kBallIor - 1.0) / (kBallIor + 1.0), 2)));
      const double noise = beam->deviation[n] / beam->exitance[n];
      weight.push_back(1.0 / (noise * noise + 1e-4));
    }
    const auto found = reconstruct::fit_beam(distance, exitance, weight, kBallIor);
    if (!found) continue;
    print_figure("led.beam_diffusion_over_truth", m.name, 3.0 * found->diffusion, "1");
    print_figure("led.beam_translucency_over_truth", m.name, found->translucency * g, "1");
  }
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

}  // namespace opaline::bench
