// The figures of Wang 2008 made again on synthetic samples: E against n x n (Fig. 11, 14c), the effect of the
// regularisation's weight (Fig. 13), coefficients by depth (Fig. 14a, b), computing time (Table II). Data come from finite
// elements on nodes twice as close, with 1 % noise. Prints one JSON object a figure (bench/figure.h) and writes tables and
// plots; docs/paper-figures.md says what they show.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/files.h"
#include "base/log.h"
#include "bench/figure.h"
#include "bench/paper/samples.h"
#include "bench/paper/timing.h"
#include "daemon/report/plot.h"
#include "reconstruct/back_end.h"
#include "reconstruct/inverse_solver.h"

namespace opaline::bench {
namespace {

namespace fs = std::filesystem;
using daemon::CurvePlot;
using daemon::Series;
using daemon::SeriesStyle;
using reconstruct::InverseOptions;
using reconstruct::InverseResult;

constexpr int kWidth = 760;
constexpr int kHeight = 380;
constexpr double kNoise = 0.01;

struct Arguments {
  fs::path out = "docs/figures";
  std::vector<std::string> figures{"measurements", "lambda", "depth", "times"};
  bool quick = false;
};

Result<PaperSample> marble() { return make_sample("marble", {}); }
/// The marble in 1 mm cells: an eighth of the work, for what is swept.
Result<PaperSample> small_marble() {
  return make_sample("small-marble", {.block = {24, 24, 6, 1.0, 1.0, 1.0}});
}

Result<void> write(const Arguments& arguments, const std::string& name, const std::string& text) {
  if (auto made = system_files().make_directories(arguments.out); !made) return made;
  return write_whole(system_files(), arguments.out / name, text);
}

Result<void> write_plots(const Arguments& arguments,
                         const std::string& name,
                         const std::vector<CurvePlot>& plots) {
  std::vector<std::string> drawings;
  for (CurvePlot plot : plots) {
    plot.width = kWidth;
    plot.height = kHeight;
    const auto drawing = daemon::draw(plot, fmt::format("drawing_{}", drawings.size()), {});
    if (!drawing) return drawing.error();
    drawings.push_back(*drawing);
  }
  return write(arguments, name + ".svg", daemon::svg_file(drawings, kWidth, kHeight));
}

Series line(std::string title, std::string color) {
  Series series{.title = std::move(title), .color = std::move(color), .x = {}, .y = {}};
  series.style = SeriesStyle::kLinePoints;
  return series;
}

Result<InverseResult> invert(const Dataset& dataset, InverseOptions options) {
  options.model = reconstruct::Model::kHeterogeneous;
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  NullSink events;
  const SystemClock clock;
  return reconstruct::reconstruct_material(dataset, options, {**solver, events, clock}, {});
}

Result<double> error_of(const PaperSample& sample, const Material& material) {
  const auto solver = reconstruct::make_solver({});
  if (!solver) return solver.error();
  return bssrdf_error(sample, material, **solver);
}

/// E after a fit of n x n pictures.
Result<double> error_with(const PaperSample& sample,
                          int n,
                          double noise,
                          const InverseOptions& options) {
  const auto dataset = measurements(sample, n, noise);
  if (!dataset) return dataset.error();
  const auto result = invert(*dataset, options);
  if (!result) return result.error();
  return error_of(sample, result->material);
}

/// Fig. 11 and 14c.
Result<void> measurements_figure(const Arguments& arguments) {
  CurvePlot plot{.x_label = "measurements, n × n",
                 .y_label = "BSSRDF error E",
                 .log_y = true,
                 .series = {},
                 .level_title = {}};
  std::string csv = "sample,n,measurements,bssrdf_error\n";
  const std::vector<int> counts =
      arguments.quick ? std::vector<int>{1, 2, 4} : std::vector<int>{1, 2, 3, 4, 5, 6, 8};
  for (const auto& [kind, color] :
       {std::pair{sim::SceneKind::kMarble, "#1f77b4"}, {sim::SceneKind::kWax, "#d62728"}}) {
    const auto sample = make_sample(std::string(sim::to_string(kind)), {.kind = kind});
    if (!sample) return sample.error();
    plot.series.push_back(line(sample->name, color));
    for (const int n : counts) {
      const auto e = error_with(*sample, n, kNoise, {});
      if (!e) return e.error();
      print_figure("paper.bssrdf_error", fmt::format("{}, n = {}", sample->name, n), *e, "1");
      csv += fmt::format("{},{},{},{:.5g}\n", sample->name, n, n * n, *e);
      plot.series.back().x.push_back(n * n);
      plot.series.back().y.push_back(*e);
    }
  }
  if (auto written = write(arguments, "paper-measurements.csv", csv); !written) return written;
  return write_plots(arguments, "paper-measurements", {plot});
}

/// Fig. 13: run on to convergence, since a fit that stops at the noise hardly feels its weight.
Result<void> lambda_figure(const Arguments& arguments) {
  const auto sample = small_marble();
  if (!sample) return sample.error();
  CurvePlot plot{.x_label = "weight of smoothness (0.1: none)",
                 .y_label = "BSSRDF error E",
                 .log_y = true,
                 .series = {},
                 .level_title = {}};
  plot.log_x = true;
  std::string csv = "noise,weight,stopped_at_noise,bssrdf_error\n";
  const auto sweep = [&](double noise, bool stops, const char* color) -> Result<void> {
    plot.series.push_back(line(
        fmt::format("noise {:g} %, {}", 100.0 * noise, stops ? "stopped there" : "to convergence"),
        color));
    for (const double weight : {0.0, 1.0, 10.0, 100.0, 300.0, 1e3, 1e4, 1e5}) {
      InverseOptions options;
      options.regularization = weight;
      if (!stops) {
        options.discrepancy = 0.0;
        options.model_error = 1e-3;
        options.stalled = 1e-3;
        options.max_iterations = arguments.quick ? 100 : 500;
      }
      const auto e = error_with(*sample, 4, noise, options);
      if (!e) return e.error();
      print_figure(
          "paper.bssrdf_error",
          fmt::format(
              "noise {:g}, weight {:g}, {}", noise, weight, stops ? "stopped" : "converged"),
          *e,
          "1");
      csv += fmt::format("{:g},{:g},{},{:.5g}\n", noise, weight, stops ? 1 : 0, *e);
      plot.series.back().x.push_back(std::max(weight, 0.1));
      plot.series.back().y.push_back(*e);
    }
    return ok();
  };
  for (const auto& [noise, stops, color] : {std::tuple{0.01, true, "#1f77b4"},
                                            {0.01, false, "#6baed6"},
                                            {0.05, true, "#d62728"},
                                            {0.05, false, "#fc9272"}})
    if (auto swept = sweep(noise, stops, color); !swept) return swept;
  if (auto written = write(arguments, "paper-lambda.csv", csv); !written) return written;
  return write_plots(arguments, "paper-lambda", {plot});
}

/// Of one layer: geometric means, and the root mean square of log found / true.
struct Layer {
  double truth = 0.0;
  double found = 0.0;
  double error = 0.0;
};

double coefficient(const ChannelCoefficients& c, bool kappa, std::size_t cell) {
  return kappa ? 1.0 / (3.0 * (c.absorption[cell] + c.reduced_scattering[cell]))
               : c.absorption[cell];
}

Layer layer_of(const Material& truth, const Material& found, bool kappa, int k) {
  const Block& b = truth.block;
  Layer layer;
  const auto cells = static_cast<double>(b.nx) * b.ny;
  for (std::size_t p = 0; p < static_cast<std::size_t>(b.nx) * b.ny; ++p) {
    const std::size_t cell = b.index(0, 0, k) + p;
    const double t = std::log(coefficient(truth.channels[1], kappa, cell));
    const double f = std::log(coefficient(found.channels[1], kappa, cell));
    layer.truth += t / cells;
    layer.found += f / cells;
    layer.error += (f - t) * (f - t) / cells;
  }
  return {std::exp(layer.truth), std::exp(layer.found), std::sqrt(layer.error)};
}

/// Fig. 14a and b, green channel.
Result<void> depth_figure(const Arguments& arguments) {
  const auto sample = marble();
  if (!sample) return sample.error();
  const auto dataset = measurements(*sample, 4, kNoise);
  if (!dataset) return dataset.error();
  const auto result = invert(*dataset, {});
  if (!result) return result.error();
  std::string csv = "coefficient,depth_below_seen_face_mm,truth,found,rms_log_error\n";
  std::vector<CurvePlot> plots;
  const Block& b = sample->truth.block;
  CurvePlot errors{.x_label = "depth below the face that the camera sees, mm",
                   .y_label = "rms of log(found / true)",
                   .series = {},
                   .level_title = {}};
  for (const bool kappa : {true, false}) {
    const std::string name = kappa ? "κ, mm" : "σa, 1/mm";
    CurvePlot plot{.x_label = errors.x_label,
                   .y_label = name,
                   .series = {line("true", "#000000"), line("found", "#d62728")},
                   .level_title = {}};
    errors.series.push_back(line(kappa ? "κ" : "σa", kappa ? "#1f77b4" : "#2ca02c"));
    for (int k = b.nz - 1; k >= 0; --k) {
      const double depth = (b.nz - k - 0.5) * b.hz;
      const Layer layer = layer_of(sample->truth, result->material, kappa, k);
      csv += fmt::format("{},{:g},{:.5g},{:.5g},{:.4g}\n",
                         kappa ? "kappa_mm" : "sigma_a_per_mm",
                         depth,
                         layer.truth,
                         layer.found,
                         layer.error);
      print_figure(kappa ? "paper.kappa_rms_log_error" : "paper.absorption_rms_log_error",
                   fmt::format("depth {:g} mm", depth),
                   layer.error,
                   "1");
      for (const auto& [series, value] : {std::pair{&plot.series[0], layer.truth},
                                          {&plot.series[1], layer.found},
                                          {&errors.series.back(), layer.error}}) {
        series->x.push_back(depth);
        series->y.push_back(value);
      }
    }
    plots.push_back(std::move(plot));
  }
  plots.push_back(std::move(errors));
  if (auto written = write(arguments, "paper-depth.csv", csv); !written) return written;
  return write_plots(arguments, "paper-depth", plots);
}

/// Table II.
Result<void> times_figure(const Arguments& arguments) {
  auto table = time_table(arguments.quick);
  if (!table) return table.error();
  std::string csv =
      "sample,cells,paper_hours,our_seconds_per_iteration,our_iterations,our_seconds,"
      "published_seconds_per_iteration,published_iterations,published_seconds,published_"
      "converged\n";
  for (const TimedSample& t : *table) {
    csv += fmt::format("{},{}x{}x{},{:g},{:.4g},{},{:.4g},{:.4g},{},{:.4g},{}\n",
                       t.name,
                       t.block.nx,
                       t.block.ny,
                       t.block.nz,
                       t.paper_hours,
                       t.ours.seconds_per_iteration,
                       t.ours.iterations,
                       t.ours.seconds(),
                       t.published.seconds_per_iteration,
                       t.published.iterations,
                       t.published.seconds(),
                       t.published_converged ? 1 : 0);
    print_figure("paper.seconds", t.name + ", ours", t.ours.seconds(), "s");
    print_figure(
        "paper.seconds",
        t.name + (t.published_converged ? ", as published" : ", as published, extrapolated"),
        t.published.seconds(),
        "s");
  }
  return write(arguments, "paper-times.csv", csv);
}

Result<void> run(const Arguments& arguments) {
  const std::vector<std::pair<std::string, std::function<Result<void>(const Arguments&)>>> all{
      {"measurements", measurements_figure},
      {"lambda", lambda_figure},
      {"depth", depth_figure},
      {"times", times_figure}};
  for (const auto& [name, figure] : all) {
    if (std::ranges::find(arguments.figures, name) == arguments.figures.end()) continue;
    if (auto done = figure(arguments); !done) return done.error().in(name);
  }
  return ok();
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Makes the figures of Wang 2008 again: tables and plots in docs/figures.\n"
      "Example: paper_figures --figure lambda --out /tmp/figures");
  bench::Arguments arguments;
  app.add_option("--figure", arguments.figures, "measurements, lambda, depth or times; default all")
      ->check(CLI::IsMember({"measurements", "lambda", "depth", "times"}))
      ->take_all();
  app.add_option("--out", arguments.out, "Directory for tables and plots")->capture_default_str();
  app.add_flag("--quick", arguments.quick, "Fewer points, smaller samples");
  CLI11_PARSE(app, argc, argv);
  log::set_level(log::Level::kWarning);
  const auto done = bench::run(arguments);
  if (!done) fmt::print(stderr, "paper_figures: {}\n", done.error().message);
  return done ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
