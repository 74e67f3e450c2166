#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/io/transport_io.h"
#include "base/log.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "sim/light_transport.h"
#include "sim/scene.h"

// opaline-transport: computes the light transport of a simulated sample into a file that the
// simulated rig can be given.

namespace {

using opaline::sim::ResponseOptions;
using opaline::sim::SceneOptions;

constexpr const char* kExamples = R"(
Examples:
  opaline-transport marble.transport --photons 1000000
      the demo's sample, quickly (about 1.5 % noise where it is bright)
  opaline-transport wax.transport --scene wax --scene-seed 7 --cells 32 32 8 --spacing 0.5 0.5 0.75
  opaline-transport front.transport --lit-face z_max --camera-angle 20
  opaline-transport better.transport --combine seed_1.transport --combine seed_2.transport
      the average of runs that differ in --seed alone, in its order

Ctrl-C stops it; the file is written whole at the end or not at all.)";

struct Arguments {
  std::string output;
  std::vector<std::string> combine;
  std::string kind = "marble";
  SceneOptions scene;
  ResponseOptions responses;
  std::vector<int> cells{48, 48, 12};
  std::vector<double> spacing{0.5, 0.5, 0.5};
  std::vector<int> patches{8, 8};
  std::string lit_face = "z_min";
  double camera_distance = 300.0;
  double camera_angle = 10.0;
};

/// Progress as one line on a terminal's stderr.
class TerminalProgress : public opaline::EventSink {
 public:
  void progress(const opaline::Progress& progress) override {
    std::fprintf(stderr,
                 "\r%s: %3.0f %%, %.0f s left   ",
                 progress.step.c_str(),
                 100.0 * progress.fraction,
                 progress.seconds_left.value_or(0.0));
  }
  opaline::Result<void> fact(std::string_view /*type*/, const nlohmann::json& /*data*/) override {
    return opaline::ok();
  }
};

void add_options(CLI::App& app, Arguments& a) {
  app.add_option("output", a.output, "file to write")->required();
  app.add_option("--scene", a.kind, "homogeneous, layered, wax, marble or stone")
      ->capture_default_str();
  app.add_option("--scene-seed", a.scene.seed, "of the sample's pattern")->capture_default_str();
  app.add_option("--cells", a.cells, "voxels along x, y, z")->expected(3)->capture_default_str();
  app.add_option("--spacing", a.spacing, "size of a voxel, mm")->expected(3)->capture_default_str();
  app.add_option("--ior", a.scene.ior, "refractive index")->capture_default_str();
  app.add_option("--scattering", a.scene.reduced_scattering, "of the ground, 1/mm")
      ->capture_default_str();
  app.add_option("--absorption", a.scene.absorption, "of the ground, 1/mm")->capture_default_str();
  app.add_option("--contrast", a.scene.contrast, "0 to 2")->capture_default_str();
  app.add_option("--feature", a.scene.feature_mm, "size of the pattern, mm")->capture_default_str();
  app.add_option("--lit-face", a.lit_face, "z_min (from behind) or z_max (from in front)")
      ->check(CLI::IsMember({"z_min", "z_max"}))
      ->capture_default_str();
  app.add_flag("--diffuse", a.responses.diffuse_entry, "Lambertian light instead of perpendicular");
  app.add_option("--patches", a.patches, "entry patches along x and y")
      ->expected(2)
      ->capture_default_str();
  app.add_option("--camera-distance", a.camera_distance, "from the middle of face z_max, mm")
      ->capture_default_str();
  app.add_option("--camera-angle", a.camera_angle, "off its normal towards +x, degrees")
      ->capture_default_str();
  app.add_option("--anisotropy", a.responses.anisotropy, "g of the phase function")
      ->capture_default_str();
  app.add_option("--seed", a.responses.seed, "of the random numbers")->capture_default_str();
  app.add_option("--photons", a.responses.photons_per_patch, "for each patch and channel")
      ->capture_default_str();
  app.add_option("--threads", a.responses.threads, "0: all processors; changes no result")
      ->capture_default_str();
  app.add_option("--combine", a.combine, "average these files instead of computing")
      ->allow_extra_args(false);
  app.set_version_flag("--version", std::string(opaline::daemon::version()));
  app.footer(kExamples);
}

opaline::Result<void> combine_files(const Arguments& a) {
  auto sum = opaline::read_transport(a.combine.front());
  for (std::size_t i = 1; sum && i < a.combine.size(); ++i) {
    const auto next = opaline::read_transport(a.combine[i]);
    if (!next) return next.error();
    sum = opaline::sim::combine(*sum, *next);
    if (!sum) return sum.error().in(a.combine[i]);
  }
  if (!sum) return sum.error();
  return write_transport(opaline::system_files(), a.output, *sum);
}

opaline::Result<void> run(Arguments& a, const std::stop_token& stop) {
  if (!a.combine.empty()) return combine_files(a);
  const auto kind = opaline::sim::scene_kind(a.kind);
  if (!kind) return kind.error();
  a.scene.kind = *kind;
  a.scene.block = {a.cells[0], a.cells[1], a.cells[2], a.spacing[0], a.spacing[1], a.spacing[2]};
  const auto material = make_material(a.scene);
  if (!material) return material.error();
  ResponseOptions& options = a.responses;
  options.lit_face = a.lit_face == "z_min" ? opaline::Face::kZMin : opaline::Face::kZMax;
  options.patches_x = a.patches[0];
  options.patches_y = a.patches[1];
  options.camera_centre =
      opaline::sim::camera_above(a.scene.block, a.camera_distance, a.camera_angle);
  TerminalProgress progress;
  const auto responses = compute_responses(*material, options, to_json(a.scene), progress, stop);
  std::fputc('\n', stderr);
  if (!responses) return responses.error();
  return write_transport(opaline::system_files(), a.output, *responses);
}

int program(int argc, char** argv) {
  CLI::App app("Computes the light transport of a simulated sample, patch by patch.");
  Arguments arguments;
  add_options(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::stop_source stop;
  const auto signals = opaline::daemon::StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) {
    opaline::log::error("{}", signals.error().message);
    return 1;
  }
  const auto done = run(arguments, stop.get_token());
  if (done) return 0;
  opaline::log::error("{}", done.error().message);
  return opaline::daemon::status_of(done);
}

}  // namespace

int main(int argc, char** argv) { return opaline::daemon::run_program(argc, argv, program); }
