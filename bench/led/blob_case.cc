#include "bench/led/blob_case.h"

#include <fmt/format.h>

#include <string>

#include "bench/figure.h"
#include "bench/led/stage_figures.h"

namespace opaline::bench {
namespace {

void print_blob(const std::string& which, const StageErrors& e) {
  const char* const name = which.c_str();
  print_figure("led.diffusion_error_mc", name, e.error_90, "1");
  print_figure("led.scattering_error_mc", name, e.scattering_error_90, "1");
  print_figure("led.albedo_error_mc", name, e.albedo_error, "1");
  print_figure("led.stage_diffusion_bias", name, e.bias, "1");
  print_figure("led.stage_diffusion_error", name, e.error, "1");
  print_figure("led.coverage_2sigma", name, e.coverage, "1");
  print_figure("led.stated_deviation", name, e.stated, "1");
  print_figure("led.share_found", name, e.found, "1");
  print_figure("led.normal_error_deg", name, e.normal_deg, "degrees");
  print_figure("led.normal_error_deg",
               fmt::format("{}, answered", which).c_str(),
               e.answered_normal_deg,
               "degrees");
  print_reasons(which, e);
}

}  // namespace

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
    print_blob(fmt::format("{}, noise-free", body), stage.run(shot, team));
    print_blob(body, stage.run({}, team));
  }
}

}  // namespace opaline::bench
