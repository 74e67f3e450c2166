// The inversion on stored light transport, without a capture: relighting error under held-out lights and the BSSRDF
// error E over the patches. One JSON object a line.

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <cstdio>

#include "base/clock.h"
#include "base/io/transport_io.h"
#include "bench/figure.h"
#include "bench/transport_dataset.h"
#include "reconstruct/back_end.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "sim/scene.h"

namespace opaline::bench {
namespace {

Dataset only(const Dataset& dataset, const std::string& kind) {
  Dataset some = dataset;
  std::erase_if(some.illuminations,
                [&](const Illumination& i) { return !i.name.starts_with(kind); });
  return some;
}

// Relighting errors by kind of light, and E = sum (R' - R)^2 / sum R^2 over all patches, cells and channels.
Result<void> judge(const char* which,
                   const TransportResponses& responses,
                   const Dataset& dataset,
                   const Material& material,
                   const reconstruct::InverseOptions& options,
                   reconstruct::diffusion::FluenceSolver& solver) {
  for (const char* kind : {"region", "shifted", "larger", "smaller", ""}) {
    const Dataset some = only(dataset, kind);
    const auto pictures = reconstruct::predict(some, material, options, solver, {});
    if (!pictures) return pictures.error();
    const bool held_out = std::string_view(kind) != "region";
    const auto error = reconstruct::relighting_error(some, *pictures, held_out);
    const std::string name = fmt::format("{}, {}", which, *kind == 0 ? "held out" : kind);
    print_figure("inverse.relighting_error", name, error.error, "");
    print_figure("inverse.noise_floor", name, error.noise_floor, "");
  }
  const Dataset patches = patch_dataset(responses);
  const auto predicted = reconstruct::predict(patches, material, options, solver, {});
  if (!predicted) return predicted.error();
  const auto error = reconstruct::relighting_error(patches, *predicted, true);
  print_figure("inverse.bssrdf_error", which, error.error * error.error, "");
  print_figure("inverse.bssrdf_error_floor", which, error.noise_floor * error.noise_floor, "");
  return ok();
}

Result<void> run(const std::string& file,
                 const TransportDatasetOptions& data,
                 const reconstruct::InverseOptions& options) {
  const auto responses = read_transport(file);
  if (!responses) return responses.error();
  const Dataset dataset = dataset_from_transport(*responses, data);
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  NullSink events;
  const SystemClock clock;
  const auto result =
      reconstruct::reconstruct_material(dataset, options, {**solver, events, clock}, {});
  if (!result) return result.error();
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const auto& channel = result->channels[c];
    print_figure("inverse.chi_squared_per_datum",
                 kChannelNames[c],
                 channel.history.back().chi_squared_per_datum,
                 "");
    print_figure("inverse.iterations", kChannelNames[c], channel.history.back().iteration, "");
    print_figure("inverse.solves", kChannelNames[c], static_cast<double>(channel.solves), "");
  }
  print_figure("inverse.seconds", "three channels", result->seconds, "s");
  if (const auto scene = sim::scene_from_json(responses->scene)) {
    const auto truth = sim::make_material(*scene);
    if (!truth) return truth.error();
    auto judged = judge("true material", *responses, dataset, *truth, options, **solver);
    if (!judged) return judged;
  }
  return judge("reconstructed", *responses, dataset, result->material, options, **solver);
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Reconstructs a sample from stored light transport and judges it by lights it never saw.");
  std::string file = "sim/data/demo_marble.transport";
  bench::TransportDatasetOptions data;
  reconstruct::InverseOptions options;
  app.add_option("responses", file, "Transport file");
  app.add_option("--regions", data.regions, "n x n regions to fit");
  app.add_option("--noise", data.noise, "Relative noise added");
  app.add_option("--seed", data.seed, "Of the noise");
  app.add_option("--regularization", options.regularization);
  app.add_option("--model-error", options.model_error);
  app.add_option("--discrepancy", options.discrepancy);
  app.add_option("--stalled", options.stalled);
  app.add_option("--tolerance", options.tolerance);
  app.add_option("--max-iterations", options.max_iterations);
  app.add_option("--threads", options.threads);
  CLI11_PARSE(app, argc, argv);
  const auto done = bench::run(file, data, options);
  if (done) return 0;
  std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return 1;
}
