// opaline-tradeoff: measures what each setting of the reconstruction costs and gains on a session's own pictures.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "base/clock.h"
#include "base/files.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/terminal.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/tradeoff/measured_dataset.h"
#include "daemon/tradeoff/tradeoff_plot.h"
#include "reconstruct/tradeoff.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using reconstruct::TradeoffPoint;

struct Arguments {
  fs::path directory;
  fs::path out;
  bool quick = false;
  double limit_seconds = 600.0;
};

/// Shows the reconstruction under way as a session's progress is shown.
class TerminalSink : public EventSink {
 public:
  explicit TerminalSink(ProgressView& view) : view_(view) {}
  void begin(std::string setting) { setting_ = std::move(setting); }
  void progress(const Progress& progress) override {
    view_.on_event(
        "progress",
        {{"step", setting_}, {"fraction", progress.fraction}, {"detail", progress.detail}});
  }
  Result<void> fact(std::string_view /*type*/, const nlohmann::json& /*data*/) override {
    return ok();
  }

 private:
  ProgressView& view_;
  std::string setting_;
};

std::string outcome(const TradeoffPoint& p) {
  if (!p.failed.empty()) return p.failed;
  std::string text =
      fmt::format("{:.2f} s, relighting error {:.2f} %", p.seconds, 100.0 * p.held_out.error);
  if (p.bssrdf_error) text += fmt::format(", E {:.4f}", *p.bssrdf_error);
  return text;
}

Result<void> write_table(const fs::path& out, std::vector<TradeoffPoint>& points) {
  reconstruct::mark_front(points);
  return write_whole(system_files(), out / "tradeoff.csv", reconstruct::tradeoff_csv(points));
}

/// Measures until done or stopped; each point is in the table before the next begins.
Result<void> measure_all(const Arguments& arguments,
                         const MeasuredDataset& data,
                         ProgressView& view,
                         std::vector<TradeoffPoint>& points,
                         const std::stop_token& stop) {
  const SystemClock clock;
  TerminalSink events(view);
  const auto settings = reconstruct::settings_of(
      reconstruct::plan_tradeoff(data.dataset, arguments.quick), data.options);
  for (std::size_t s = 0; s < settings.size(); ++s) {
    const std::string name =
        fmt::format("{}/{}  {}", s + 1, settings.size(), describe(settings[s]));
    events.begin(name);
    auto point =
        reconstruct::measure(data.dataset,
                             settings[s],
                             {solver_of, events, clock, judge_of(data), arguments.limit_seconds},
                             stop);
    if (!point) return point.error();
    view.say(fmt::format("{}: {}", name, outcome(*point)));
    points.push_back(*std::move(point));
    if (auto written = write_table(arguments.out, points); !written) return written;
  }
  return ok();
}

/// Also of what was measured before a stop: drawing takes no token.
Result<void> draw_front(const fs::path& out, const std::vector<TradeoffPoint>& points) {
  const auto svg = tradeoff_svg(points, {});
  if (!svg) return svg.error().in("tradeoff.svg");
  return write_whole(system_files(), out / "tradeoff.svg", *svg);
}

void print_front(std::vector<TradeoffPoint> points, const fs::path& out) {
  std::erase_if(points, [](const TradeoffPoint& p) { return !p.on_front; });
  std::ranges::sort(points, {}, &TradeoffPoint::seconds);
  fmt::print("\nThe front, from fast to accurate:\n");
  for (const TradeoffPoint& p : points)
    fmt::print("  {:<60} {}\n", describe(p.setting), outcome(p));
  fmt::print(
      "table  {}\nplot   {}\n", (out / "tradeoff.csv").string(), (out / "tradeoff.svg").string());
}

Result<void> run(Arguments& arguments) {
  const auto data = read_measured_dataset(arguments.directory);
  if (!data) return data.error();
  if (arguments.out.empty()) arguments.out = arguments.directory / "tradeoff";
  if (auto made = system_files().make_directories(arguments.out); !made) return made;
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const SystemClock clock;
  ProgressView view(terminal_options(), clock);
  std::vector<TradeoffPoint> points;
  auto done = measure_all(arguments, *data, view, points, stop.get_token());
  if (points.empty()) return done;
  if (auto drawn = draw_front(arguments.out, points); !drawn) return drawn;
  print_front(points, arguments.out);
  return done;
}

int program(int argc, char** argv) {
  CLI::App app(
      "Measures what each setting of the reconstruction costs and gains on a session's own "
      "pictures: regions, grid,\n"
      "tolerance, iterations, optimiser and back end, in seconds and relighting error.");
  Arguments arguments;
  app.add_option("DIR", arguments.directory, "A session directory, or one with a dataset")
      ->required();
  app.add_option(
      "--out", arguments.out, "Directory for tradeoff.csv and tradeoff.svg; default DIR/tradeoff");
  app.add_flag("--quick", arguments.quick, "Only what takes seconds");
  app.add_option("--limit", arguments.limit_seconds, "Seconds after which a setting is given up")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.footer(
      "Ctrl-C stops and keeps what was measured.\n\nExamples:\n"
      "  opaline-tradeoff ~/sessions/20260131-123456-ab12cd-marble\n"
      "  opaline-tradeoff --quick --out /tmp/front ~/sessions/20260131-123456-ab12cd-marble");
  return run_command(app, "opaline-tradeoff", argc, argv, [&] { return run(arguments); });
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_program(argc, argv, opaline::daemon::program);
}
