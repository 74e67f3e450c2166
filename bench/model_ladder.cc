// Which rung of the model ladder (reconstruct/model_choice.h) each kind of sample stops on, with data from Monte Carlo
// transport, which shares no equation with the reconstruction: homogeneous, layered, veined. Prints one JSON object a
// figure (bench/figure.h); the transport is computed once and kept (sim/transport_store.h).

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "base/clock.h"
#include "bench/figure.h"
#include "bench/inverse/transport_dataset.h"
#include "reconstruct/back_end.h"
#include "reconstruct/inverse_solver.h"
#include "sim/scene.h"
#include "sim/transport_store.h"

namespace opaline::bench {
namespace {

constexpr int kPatches = 8;

Result<Dataset> measure(const std::string& kind,
                        std::uint64_t photons,
                        const TransportDatasetOptions& data) {
  const auto scene_kind = sim::scene_kind(kind);
  if (!scene_kind) return scene_kind.error();
  const sim::SceneOptions scene{.kind = *scene_kind, .block = {24, 24, 8, 0.75, 0.75, 0.75}};
  const sim::ResponseOptions options{.patches_x = kPatches,
                                     .patches_y = kPatches,
                                     .camera_centre = sim::camera_above(scene.block, 300.0, 10.0),
                                     .photons_per_patch = photons};
  fmt::print(stderr, "{}: light transport, a minute or so the first time\n", kind);
  NullSink events;
  const auto responses = sim::load_or_compute(scene, options, {}, events, {});
  if (!responses) return responses.error();
  return dataset_from_transport(*responses, data);
}

Result<void> climb(const std::string& kind,
                   const Dataset& dataset,
                   const reconstruct::InverseOptions& options) {
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  NullSink events;
  const SystemClock clock;
  const auto result =
      reconstruct::reconstruct_material(dataset, options, {**solver, events, clock}, {});
  if (!result) return result.error();
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const reconstruct::ChannelReport& channel = result->channels[c];
    for (std::size_t n = 0; n < channel.ladder.size(); ++n) {
      const reconstruct::ModelReport& rung = channel.ladder[n];
      const std::string name = fmt::format("{}, {}, {}", kind, kChannelNames[c], rung.name);
      print_figure("ladder.held_out_chi_squared_per_datum", name, rung.held_out, "1");
      print_figure("ladder.held_out_standard_error", name, rung.standard_error, "1");
      print_figure("ladder.solves", name, static_cast<double>(rung.solves), "1");
      if (rung.name == channel.model)
        print_figure("ladder.rung",
                     fmt::format("{}, {}", kind, kChannelNames[c]),
                     static_cast<double>(n),
                     channel.model);
    }
    const reconstruct::HomogeneousFit& two = channel.homogeneous;
    if (two.absorption_interval) {
      fmt::print(
          stderr,
          "{}, {}: sigma_s' {:.4f} [{:.4f}, {:.4f}], sigma_a {:.5f} [{:.5f}, {:.5f}] per mm\n",
          kind,
          kChannelNames[c],
          two.reduced_scattering,
          two.reduced_scattering_interval->lowest,
          two.reduced_scattering_interval->highest,
          two.absorption,
          two.absorption_interval->lowest,
          two.absorption_interval->highest);
    }
    fmt::print(
        stderr, "{}, {}: {}: {}\n", kind, kChannelNames[c], channel.model, channel.model_reason);
  }
  print_figure("ladder.relighting_error", kind, result->held_out.error, "1");
  print_figure("ladder.noise_floor", kind, result->held_out.noise_floor, "1");
  print_figure("ladder.seconds", kind, result->seconds, "s");
  return ok();
}

int run_all(const std::vector<std::string>& kinds,
            std::uint64_t photons,
            const TransportDatasetOptions& data,
            const reconstruct::InverseOptions& options) {
  for (const std::string& kind : kinds) {
    const auto dataset = measure(kind, photons, data);
    const auto done = dataset ? climb(kind, *dataset, options) : Result<void>(dataset.error());
    if (done) continue;
    fmt::print(stderr, "{}: {}\n", kind, done.error().message);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Climbs the ladder of models on samples whose kind is known, with Monte Carlo data.\n"
      "Example: model_ladder --kind layered --noise 0.02");
  std::vector<std::string> kinds{"homogeneous", "layered", "marble"};
  std::uint64_t photons = 1 << 17;
  bench::TransportDatasetOptions data;
  reconstruct::InverseOptions options;
  app.add_option("--kind", kinds, "homogeneous, layered, wax, marble, stone")->take_all();
  app.add_option("--photons", photons, "A patch and channel");
  app.add_option("--noise", data.noise, "Relative noise added");
  app.add_option("--seed", data.seed, "Of the noise");
  std::string model = "auto";
  const std::map<std::string, reconstruct::Model> models{
      {"auto", reconstruct::Model::kAuto},
      {"homogeneous", reconstruct::Model::kHomogeneous},
      {"layered", reconstruct::Model::kLayered},
      {"heterogeneous", reconstruct::Model::kHeterogeneous}};
  app.add_option("--model", model, "To compare: what auto chooses between")
      ->check(CLI::IsMember(models));
  app.add_option("--model-error", options.model_error);
  app.add_option("--threads", options.threads);
  CLI11_PARSE(app, argc, argv);
  options.model = models.at(model);
  return bench::run_all(kinds, photons, data, options);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
