// Seconds against accuracy on the simulated rig's own light transport, setting by setting: the figures behind
// `quality` and `target_error` (docs/accuracy.md). Prints one JSON object a figure (bench/figure.h).

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/files.h"
#include "base/io/transport_io.h"
#include "base/log.h"
#include "bench/figure.h"
#include "bench/inverse/transport_dataset.h"
#include "config/quality.h"
#include "daemon/tradeoff/measured_dataset.h"
#include "daemon/tradeoff/tradeoff_plot.h"
#include "reconstruct/back_end.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "reconstruct/tradeoff.h"

namespace opaline::bench {
namespace {

namespace fs = std::filesystem;
using reconstruct::TradeoffPoint;
using reconstruct::TradeoffSetting;

struct Arguments {
  fs::path transport = "sim/data/demo_marble.transport";
  fs::path out;
  bool quick = false;
  double noise = 0.01;
  double limit_seconds = 300.0;
};

/// 8 x 8 regions to fit, held out the shifted, larger and smaller lights of 4 x 4: with as many regions as patches none
/// can be shifted by half.
Dataset dataset_of(const TransportResponses& responses, double noise) {
  Dataset dataset = dataset_from_transport(responses, {.regions = 4, .noise = noise, .seed = 2});
  std::erase_if(dataset.illuminations, [](const Illumination& i) { return !i.held_out; });
  Dataset fine =
      dataset_from_transport(responses, {.regions = responses.patches_x, .noise = noise});
  for (Illumination& i : fine.illuminations)
    if (!i.held_out) dataset.illuminations.push_back(std::move(i));
  return dataset;
}

/// E = sum (R' - R)^2 / sum R^2 over all patches, cells and channels.
Result<double> bssrdf_error(const TransportResponses& responses,
                            const Material& material,
                            std::stop_token stop) {
  const reconstruct::InverseOptions options;
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  const Dataset patches = patch_dataset(responses);
  const auto predicted =
      reconstruct::predict(patches, material, options, **solver, std::move(stop));
  if (!predicted) return predicted.error();
  const double error = reconstruct::relighting_error(patches, *predicted, true).error;
  return error * error;
}

/// The three qualities as the reconstruction sees them.
std::vector<TradeoffSetting> qualities() {
  std::vector<TradeoffSetting> all;
  for (const auto quality :
       {config::Quality::kDraft, config::Quality::kStandard, config::Quality::kReference}) {
    config::SessionConfig session;
    config::apply(quality, session);
    TradeoffSetting setting{fmt::format("quality {}", config::to_string(quality)),
                            {session.reduction.grid_step, session.capture.patterns.regions},
                            session.reconstruction};
    setting.options.back_end = reconstruct::BackEnd::kHost;
    all.push_back(std::move(setting));
  }
  return all;
}

/// Around the standard quality: 4 x 4 regions.
std::vector<TradeoffSetting> settings(const Arguments& arguments) {
  reconstruct::TradeoffPlan plan = reconstruct::plan_tradeoff({}, arguments.quick);
  plan.regions = {4, 8, 2, 1};
  auto all = reconstruct::settings_of(plan, {});
  for (TradeoffSetting& quality : qualities()) all.push_back(std::move(quality));
  return all;
}

void print(const std::string& material, const TradeoffPoint& p) {
  const std::string name =
      fmt::format("{}, {}: {}", material, p.setting.dial, reconstruct::describe(p.setting));
  if (!p.failed.empty()) return fmt::print(stderr, "{}: {}\n", name, p.failed);
  print_figure("tradeoff.seconds", name, p.seconds, "s");
  print_figure("tradeoff.solves", name, static_cast<double>(p.solves), "1");
  print_figure("tradeoff.relighting_error", name, p.held_out.error, "1");
  print_figure("tradeoff.noise_floor", name, p.held_out.noise_floor, "1");
  if (p.bssrdf_error) print_figure("tradeoff.bssrdf_error", name, *p.bssrdf_error, "1");
}

Result<void> keep(const fs::path& out, std::vector<TradeoffPoint>& points) {
  if (out.empty()) return ok();
  if (auto made = system_files().make_directories(out); !made) return made;
  reconstruct::mark_front(points);
  auto written =
      write_whole(system_files(), out / "tradeoff.csv", reconstruct::tradeoff_csv(points));
  if (!written) return written;
  const auto svg = daemon::tradeoff_svg(points, {});
  if (!svg) return svg.error();
  return write_whole(system_files(), out / "tradeoff.svg", *svg);
}

Result<void> run(const Arguments& arguments) {
  const auto responses = read_transport(arguments.transport);
  if (!responses) return responses.error();
  const Dataset dataset = dataset_of(*responses, arguments.noise);
  NullSink events;
  const SystemClock clock;
  const reconstruct::TradeoffContext context{daemon::solver_of,
                                             events,
                                             clock,
                                             [&](const Material& material, std::stop_token stop) {
                                               return bssrdf_error(
                                                   *responses, material, std::move(stop));
                                             },
                                             arguments.limit_seconds};
  std::vector<TradeoffPoint> points;
  for (const TradeoffSetting& setting : settings(arguments)) {
    auto point = reconstruct::measure(dataset, setting, context, {});
    if (!point) return point.error().in(reconstruct::describe(setting));
    print(arguments.transport.stem().string(), *point);
    points.push_back(*std::move(point));
  }
  return keep(arguments.out, points);
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Seconds against accuracy on simulated light transport, setting by setting.\n"
      "Example: tradeoff --quick; tradeoff --out docs/figures");
  bench::Arguments arguments;
  app.add_option("--case", arguments.transport, "A transport file")->capture_default_str();
  app.add_option("--out", arguments.out, "Also write tradeoff.csv and tradeoff.svg there");
  app.add_flag("--quick", arguments.quick, "Only what takes seconds");
  app.add_option("--noise", arguments.noise, "Relative noise added")->capture_default_str();
  app.add_option("--limit", arguments.limit_seconds, "Seconds after which a setting is given up")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  log::set_level(log::Level::kWarning);
  const auto done = bench::run(arguments);
  if (!done) fmt::print(stderr, "tradeoff: {}\n", done.error().message);
  return done ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
