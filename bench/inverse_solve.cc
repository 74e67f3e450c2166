// The inversion on known light transport, without a capture: how many solves it takes to the noise, and how well the
// material that it finds relights under lights that it never saw. Prints one JSON object a figure (bench/figure.h).

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/files.h"
#include "base/io/transport_io.h"
#include "bench/figure.h"
#include "bench/forward/forward_case.h"
#include "bench/inverse/finite_elements.h"
#include "bench/inverse/material_cases.h"
#include "bench/inverse/material_error.h"
#include "bench/inverse/posterior_figures.h"
#include "bench/inverse/timed_solver.h"
#include "bench/inverse/transport_dataset.h"
#include "reconstruct/back_end.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/diffusion/source.h"
#include "reconstruct/direct_light.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "sim/scene.h"

namespace opaline::bench {
namespace {

namespace fs = std::filesystem;
using reconstruct::InverseOptions;
using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::FluenceSolver;

constexpr int kPatches = 8;
constexpr int kRelaxedPictures = 16;        // that relaxation takes in one sweep
constexpr int kPublishedIterations = 1500;  // after which the published method is given up

struct Case {
  std::string name;
  TransportResponses responses;
  int regions = 4;
};

fs::path cache_directory() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return fs::path(cache) / "opaline/bench";
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".cache/opaline/bench";
  return fs::temp_directory_path() / "opaline-bench";
}

/// A sample that the data come from finite elements of.
struct Sample {
  const char* name;
  sim::SceneOptions scene;
  Refinement refinement;  ///< of the cells
};

std::vector<Sample> samples() {
  const auto of = [](sim::SceneKind kind, const Block& block) {
    sim::SceneOptions scene;
    scene.kind = kind;
    scene.block = block;
    return scene;
  };
  using enum sim::SceneKind;
  return {{"24x24x6", of(kMarble, {24, 24, 6, 1.0, 1.0, 1.0}), {2, 2, 2}},
          {"48x48x12", {}, {2, 2, 2}},
          {"96x96x24", of(kMarble, {96, 96, 24, 0.25, 0.25, 0.25}), {2, 2, 2}},
          {"wax1", of(kWax, {130, 53, 37, 0.5, 0.5, 0.5}), {2, 2, 2}},
          {"marble", of(kMarble, {256, 256, 20, 0.5, 0.5, 0.5}), {1, 1, 2}}};
}

/// From the cache, or computed and put there.
Result<TransportResponses> elements_of(const Sample& sample) {
  const fs::path file = cache_directory() / fmt::format("elements-{}.transport", sample.name);
  if (auto stored = read_transport(file); stored && stored->scene == sim::to_json(sample.scene))
    return stored;
  const auto material = sim::make_material(sample.scene);
  if (!material) return material.error();
  fmt::print(stderr, "{}: finite elements, some minutes the first time\n", sample.name);
  TransportResponses responses = finite_element_responses(*material, kPatches, sample.refinement);
  responses.scene = sim::to_json(sample.scene);
  std::error_code ignored;
  fs::create_directories(file.parent_path(), ignored);
  if (auto kept = write_transport(system_files(), file, responses); !kept)
    fmt::print(stderr, "not kept: {}\n", kept.error().message);
  return responses;
}

Result<Case> make_case(const std::string& name) {
  const bool finer = name.ends_with("-n8");
  const std::string sample_name = finer ? name.substr(0, name.size() - 3) : name;
  for (const Sample& sample : samples()) {
    if (sample_name != sample.name) continue;
    auto responses = elements_of(sample);
    if (!responses) return responses.error();
    return Case{name, *std::move(responses), finer ? 8 : 4};
  }
  if (const auto material = material_case(name)) {
    auto responses = responses_of(*material, cache_directory());
    if (!responses) return responses.error();
    return Case{name, *std::move(responses), 4};
  }
  if (!name.ends_with(".transport")) {
    return invalid_argument(
        fmt::format("no case '{}'; there are 24x24x6, 48x48x12, 96x96x24, wax1 and marble, each "
                    "also with -n8 after it, "
                    "{} and *.transport files",
                    name,
                    fmt::join(material_case_names(), ", ")));
  }
  auto responses = read_transport(name);
  if (!responses) return responses.error();
  return Case{fs::path(name).stem(), *std::move(responses), 4};
}

Dataset only(const Dataset& dataset, const std::string& kind) {
  Dataset some = dataset;
  std::erase_if(some.illuminations,
                [&](const Illumination& i) { return !i.name.starts_with(kind); });
  return some;
}

/// Of the cells of all held-out pictures, those that an error is taken over.
double held_out_share(const Dataset& dataset) {
  std::size_t counted = 0;
  std::size_t all = 0;
  for (const Illumination& i : dataset.illuminations) {
    if (!i.held_out) continue;
    const auto cells = i.mask.samples();
    counted += cells.size() - static_cast<std::size_t>(std::ranges::count(cells, 0));
    all += cells.size();
  }
  return all == 0 ? 0.0 : static_cast<double>(counted) / static_cast<double>(all);
}

/// What the true material relights wrongly beyond the data's noise. Not for a material fitted to pictures of the same
/// paths: it has learned some of that noise.
double model_floor(const reconstruct::RelightingError& error) {
  return std::sqrt(
      std::max(0.0, error.error * error.error - error.noise_floor * error.noise_floor));
}

/// Relighting errors by kind of light, and E = sum (R' - R)^2 / sum R^2 over all patches, cells and channels.
Result<void> judge(const Case& which,
                   const char* what,
                   const Dataset& dataset,
                   double margin_mm,
                   const Material& material,
                   const InverseOptions& options,
                   FluenceSolver& solver) {
  const std::string prefix = fmt::format("inverse.{}", what);
  for (const char* kind : {"region", "shifted", "larger", "smaller", ""}) {
    const Dataset some = only(dataset, kind);
    if (some.illuminations.empty()) continue;
    const auto pictures = reconstruct::predict(some, material, options, solver, {});
    if (!pictures) return pictures.error();
    const bool held_out = std::string_view(kind) != "region";
    const auto error = reconstruct::relighting_error(some, *pictures, held_out);
    const std::string name = *kind == 0 ? which.name : fmt::format("{}, {}", which.name, kind);
    print_figure(prefix + "relighting_error", name, error.error, "1");
    print_figure(prefix + "noise_floor", name, error.noise_floor, "1");
    if (std::string_view(what) == "truth_")
      print_figure("inverse.model_floor", name, model_floor(error), "1");
  }
  const Dataset patches =
      reconstruct::without_direct_light(patch_dataset(which.responses), margin_mm);
  const auto predicted = reconstruct::predict(patches, material, options, solver, {});
  if (!predicted) return predicted.error();
  const auto error = reconstruct::relighting_error(patches, *predicted, true);
  print_figure(prefix + "bssrdf_error", which.name, error.error * error.error, "1");
  return ok();
}

struct Effort {
  double solves = 0.0;  ///< for one right-hand side, of the channel that took most
  double seconds = 0.0;
};

Effort effort_of(const reconstruct::InverseResult& result) {
  Effort effort{0.0, result.seconds};
  for (const auto& channel : result.channels)
    effort.solves = std::max(effort.solves, static_cast<double>(channel.solves));
  return effort;
}

/// Seconds that the paper's hierarchical relaxation takes for all pictures of one material, to a front-face error of
/// 1e-4: its own solver, which the published method is given here only on paper.
Result<double> relaxation_seconds(const Dataset& dataset,
                                  const Material& material,
                                  const InverseOptions& options,
                                  FluenceSolver& solver) {
  const auto problem =
      reconstruct::make_channel_problem(dataset, 1, options, reconstruct::Selection::kFit);
  if (!problem) return problem.error();
  ForwardCase forward{
      "published",
      reconstruct::diffusion::make_medium(problem->block, material.channels[1], problem->boundary),
      {problem->block.cell_count(), kRelaxedPictures}};
  const reconstruct::diffusion::FaceSource light(
      forward.medium, problem->boundary, problem->lit_face, problem->source);
  const auto count = problem->illuminations.size();
  for (std::size_t m = 0; m < kRelaxedPictures; ++m)
    light.deposit(problem->illuminations[m % count].irradiance,
                  {forward.b.field(static_cast<int>(m)), forward.b.cells});
  FieldBatch exact(forward.b.cells, forward.b.count);
  if (auto ready = solver.prepare(forward.medium); !ready) return ready.error();
  if (auto solved = solver.solve(forward.b, exact, {1e-10, 100}, {}); !solved)
    return solved.error();
  return run_relaxation(forward, exact, 1e-4).seconds / kRelaxedPictures;
}

/// The same data by the paper's own minimisation, with its objective and stopping rule as ours.
Result<void> compare_with_published(const Case& which,
                                    const Dataset& dataset,
                                    InverseOptions options,
                                    const reconstruct::InverseResult& ours,
                                    FluenceSolver& solver) {
  options.method = reconstruct::Method::kAsPublished;
  options.max_iterations = kPublishedIterations;
  options.coarser_grids = 0;
  options.stalled = 0.0;
  NullSink events;
  const SystemClock clock;
  const auto result =
      reconstruct::reconstruct_material(dataset, options, {solver, events, clock}, {});
  if (!result) return result.error();
  const Effort published = effort_of(*result);
  const Effort effort = effort_of(ours);
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    print_figure("inverse.published_chi_squared_per_datum",
                 fmt::format("{}, {}", which.name, kChannelNames[c]),
                 result->channels[c].history.back().chi_squared_per_datum,
                 "1");
  }
  print_figure("inverse.published_solves", which.name, published.solves, "1");
  print_figure("inverse.published_seconds_by_our_solver", which.name, published.seconds, "s");
  print_figure(
      "inverse.solves_ratio_vs_published", which.name, published.solves / effort.solves, "x");
  const auto relaxed = relaxation_seconds(dataset, result->material, options, solver);
  if (!relaxed) return relaxed.error();
  double solves = 0.0;
  for (const auto& channel : result->channels) solves += static_cast<double>(channel.solves);
  const double seconds = solves * *relaxed;
  print_figure("inverse.published_seconds", which.name, seconds, "s");  // solves x time of one
  print_figure("inverse.wall_ratio_vs_published", which.name, seconds / effort.seconds, "x");
  return ok();
}

/// What is done beside the inversion itself.
struct Extras {
  bool published = false;
  bool posterior = false;
};

Result<void> run(const Case& which,
                 TransportDatasetOptions data,
                 const InverseOptions& options,
                 const Extras& extras) {
  data.regions = which.regions;
  const Dataset dataset = dataset_from_transport(which.responses, data);
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  NullSink events;
  const SystemClock clock;
  TimedSolver timed(**solver);
  reset_peak_megabytes();
  const auto result =
      reconstruct::reconstruct_material(dataset, options, {timed, events, clock}, {});
  if (!result) return result.error();
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const auto& channel = result->channels[c];
    const std::string name = fmt::format("{}, {}", which.name, kChannelNames[c]);
    print_figure(
        "inverse.chi_squared_per_datum", name, channel.history.back().chi_squared_per_datum, "1");
    print_figure("inverse.iterations", name, channel.history.back().iteration, "1");
  }
  print_figure("inverse.solves", which.name, effort_of(*result).solves, "1");
  print_figure("inverse.seconds", which.name, result->seconds, "s");
  print_figure("inverse.share_of_solver", which.name, timed.seconds() / result->seconds, "1");
  print_figure("inverse.peak_mb", which.name, peak_megabytes(), "MB");
  const double margin = result->direct_light_margin_mm;
  if (margin > 0.0) print_figure("inverse.direct_light_margin", which.name, margin, "mm");
  const Dataset measured = reconstruct::without_direct_light(dataset, margin);
  print_figure("inverse.share_of_held_out_cells", which.name, held_out_share(measured), "1");
  if (const auto scene = sim::scene_from_json(which.responses.scene)) {
    const auto truth = sim::make_material(*scene);
    if (!truth) return truth.error();
    if (auto judged = judge(which, "truth_", measured, margin, *truth, options, **solver); !judged)
      return judged;
    print_material_error(which.name, result->material, *truth, dataset.seen_face);
    if (extras.posterior) {
      const auto mean = print_posterior(which.name, measured, *truth, *result, options, **solver);
      if (!mean) return mean.error();
      if (auto judged = judge(which, "posterior_mean_", measured, margin, *mean, options, **solver);
          !judged)
        return judged;
    }
  }
  if (auto judged = judge(which, "", measured, margin, result->material, options, **solver);
      !judged)
    return judged;
  return extras.published ? compare_with_published(which, dataset, options, *result, **solver)
                          : ok();
}

int run_all(const std::vector<std::string>& names,
            const TransportDatasetOptions& data,
            const InverseOptions& options,
            const Extras& extras) {
  for (const std::string& name : names) {
    const auto which = make_case(name);
    const auto done = which ? run(*which, data, options, extras) : Result<void>(which.error());
    if (done) continue;
    fmt::print(stderr, "{}: {}\n", name, done.error().message);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Reconstructs samples from known light transport and judges them by lights they never saw.\n"
      "Example: inverse_solve --case 48x48x12 --regularization 100");
  std::vector<std::string> names{"48x48x12", "48x48x12-n8", "sim/data/demo_marble.transport"};
  for (const std::string& name : bench::material_case_names()) names.push_back(name);
  bench::TransportDatasetOptions data;
  reconstruct::InverseOptions options;
  app.add_option("--case",
                 names,
                 "48x48x12, 48x48x12-n8 (finite elements); marble, wax or stone with -back or "
                 "-front (Monte "
                 "Carlo, some minutes the first time); or a transport file")
      ->take_all();
  bench::Extras extras;
  app.add_flag(
      "--published", extras.published, "Compare with the paper's minimisation: minutes a case");
  app.add_flag("--posterior", extras.posterior, "Judge the posterior by the truth");
  app.add_option("--noise", data.noise, "Relative noise added");
  app.add_option("--seed", data.seed, "Of the noise");
  app.add_option("--regularization", options.regularization);
  bool edges = false;
  app.add_flag("--tv", edges, "Total variation as the regulariser, not H1");
  app.add_option("--model-error", options.model_error);
  std::string camera(to_string(options.camera));
  app.add_option("--camera", camera, "refracted_ray or surface")
      ->check(CLI::IsMember({"refracted_ray", "surface"}));
  app.add_option("--discrepancy", options.discrepancy);
  app.add_option("--stalled", options.stalled);
  app.add_option("--tolerance", options.tolerance);
  app.add_flag("--grid-correction",
               options.grid_correction,
               "Fit to the pictures less what the grid leaves out");
  app.add_option("--max-iterations", options.max_iterations);
  app.add_option("--coarser-grids", options.coarser_grids);
  options.model = reconstruct::Model::kHeterogeneous;
  bool ladder = false;
  app.add_flag("--ladder", ladder, "From homogeneous on, as a session does by default");
  bool gauss_newton = false;
  app.add_flag("--gauss-newton", gauss_newton, "Gauss-Newton-CG, not L-BFGS");
  app.add_option("--threads", options.threads);
  std::string precision = "single";
  app.add_option("--precision", precision, "Of the solver: half, single or double")
      ->check(CLI::IsMember({"half", "single", "double"}));
  CLI11_PARSE(app, argc, argv);
  using reconstruct::diffusion::Precision;
  for (const Precision one : {Precision::kHalf, Precision::kSingle, Precision::kDouble})
    if (to_string(one) == precision) options.precision = one;
  if (camera == to_string(reconstruct::CameraLaw::kSurface))
    options.camera = reconstruct::CameraLaw::kSurface;
  if (ladder) options.model = reconstruct::Model::kAuto;
  if (gauss_newton) options.method = reconstruct::Method::kGaussNewton;
  if (edges) options.regularizer = reconstruct::Smoothness::kTotalVariation;
  return bench::run_all(names, data, options, extras);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
