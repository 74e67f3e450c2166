// opaline-calibrate: takes a station through its calibration, step by step.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <ranges>
#include <string>

#include "base/clock.h"
#include "base/files.h"
#include "base/session_directory.h"
#include "calibration/procedure.h"
#include "calibration/store.h"
#include "config/session_config.h"
#include "daemon/calibrate/calibration_report.h"
#include "daemon/calibrate/view.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/terminal.h"
#include "daemon/driver_table.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/guardian.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "daemon/runtime_paths.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using calibration::Record;
using calibration::RecordState;
using calibration::Store;

struct Arguments {
  fs::path rig;
  std::string step;
  bool resume = false;
  fs::path view;   ///< a viewfinder instead of a calibration
  int frames = 0;  ///< of it; 0: until it is stopped
  fs::path calibrations = default_calibrations();
};

/// Shows steps as a session's progress is shown.
class TerminalSink : public EventSink {
 public:
  explicit TerminalSink(ProgressView& view) : view_(view) {}
  void progress(const Progress& p) override {
    view_.on_event("progress", {{"step", p.step}, {"fraction", p.fraction}, {"detail", p.detail}});
  }
  Result<void> fact(std::string_view /*type*/, const nlohmann::json& data) override {
    view_.say(data.value("message", data.dump()));
    return ok();
  }

 private:
  ProgressView& view_;
};

/// The newest one that is neither finished nor older than the active one's successor.
Result<std::optional<Record>> unfinished(const Store& store) {
  const std::vector<int> versions = store.versions();
  if (versions.empty()) return std::optional<Record>();
  auto newest = store.read(versions.back());
  if (!newest) return newest.error();
  if (newest->state() == RecordState::kAccepted) return std::optional<Record>();
  return std::optional(*std::move(newest));
}

/// What a single step builds on: the unfinished one, or a new version of the active one.
Result<Record> record_to_fill(const Store& store,
                              const Arguments& arguments,
                              const std::string& station) {
  const bool goes_on = arguments.resume || !arguments.step.empty();
  if (goes_on) {
    auto open = unfinished(store);
    if (!open) return open.error();
    if (*open) return **std::move(open);
    if (arguments.resume && arguments.step.empty())
      return not_found("nothing to resume: the newest calibration is accepted; leave --resume out");
  }
  Record record;
  if (!arguments.step.empty()) {
    auto active = store.read_active();
    if (!active) return active.error();
    if (*active) record = **std::move(active);
  }
  const std::vector<int> versions = store.versions();
  record.version = versions.empty() ? 1 : versions.back() + 1;
  record.station = station;
  record.created = utc_now();
  record.program = std::string(version());
  return record;
}

/// The version's own directory, in which the devices' helpers find the rig's configuration.
Result<fs::path> make_place(const fs::path& directory,
                            const config::RigConfig& rig,
                            const std::string& rig_text) {
  std::error_code none;
  if (fs::exists(directory / "session.json", none)) return directory;
  config::SessionConfig session;
  session.name = "calibration";
  session.rig = rig;
  const auto made = SessionDirectory::create(
      system_files(), directory, {"calibration", "", rig_text, config::to_toml(session)});
  if (!made) return made.error();
  return directory;
}

using WithStation = std::function<Result<void>(const capture::Station&, std::stop_token)>;

/// Opens the rig's devices, under a guardian, for what is to be done with them.
Result<void> with_station(const Arguments& arguments,
                          const config::RigConfig& rig,
                          const fs::path& directory,
                          EventSink& events,
                          const std::stop_token& asked,
                          const WithStation& work) {
  const auto text = read_text(arguments.rig);
  if (!text) return text.error();
  const auto place = make_place(directory, rig, *text);
  if (!place) return place.error();
  const auto devices = StationDevices::create(rig, *place, events, asked);
  if (!devices) return devices.error();
  const auto program = program_beside("opaline-guardian");
  if (!program) return program.error();
  const auto guardian = Guardian::start(*program, *place, asked);
  if (!guardian) return guardian.error();
  std::stop_source stop;
  const auto request = [&stop] { stop.request_stop(); };
  const std::stop_callback on_signal(asked, request);
  const std::stop_callback unguarded((*guardian)->death(), request);
  auto done = work((*devices)->station(), stop.get_token());
  if ((*guardian)->death().stop_requested())
    return unavailable("the guardian died, and without one no light stays on");
  return done;
}

Result<void> calibrate(Record& record,
                       const Arguments& arguments,
                       const config::RigConfig& rig,
                       const Store& store,
                       EventSink& events,
                       const std::stop_token& asked) {
  calibration::ProcedureOptions options;
  if (!arguments.step.empty()) options.only = arguments.step;
  options.geometry = rig.geometry;
  return with_station(arguments,
                      rig,
                      store.directory_of(record.version),
                      events,
                      asked,
                      [&](const capture::Station& station, std::stop_token stop) {
                        return calibration::run_procedure(
                            record,
                            options,
                            rig.calibration,
                            station,
                            [&](const Record& kept) { return store.write(kept); },
                            events,
                            std::move(stop));
                      });
}

/// Black and clipping as calibrated last, or as the rig file has them.
Result<void> look(const Arguments& arguments, const config::RigConfig& rig, const Store& store) {
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const auto active = store.read_active();
  auto known = rig.calibration;
  if (active && *active) known = calibration::with_measured(known, (*active)->measured);
  const ViewOptions options{fs::absolute(arguments.view),
                            arguments.frames,
                            known.camera.black_level,
                            capture::clipping_code(known.camera)};
  fmt::print("{}\n", (options.directory / "view.png").string());
  NullSink events;
  const auto say = [](const std::string& line) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
  };
  const fs::path place = options.directory / ".station";  // of another rig, perhaps
  std::error_code none;
  fs::remove_all(place, none);
  return with_station(arguments,
                      rig,
                      place,
                      events,
                      stop.get_token(),
                      [&](const capture::Station& station, const std::stop_token& token) {
                        return run_viewfinder(options, station, system_files(), events, say, token);
                      });
}

/// What became of it, for people; an error where it was refused.
Result<void> conclude(const Record& record, const Store& store, const std::string& rig) {
  const std::string file = (store.directory_of(record.version) / "calibration.json").string();
  if (record.state() == RecordState::kRefused) {
    return unavailable(
        fmt::format("calibration {} is refused, and kept in {}; mend the cause and go on with "
                    "\"opaline calibrate --resume {}\"",
                    record.version,
                    file,
                    rig));
  }
  if (record.state() == RecordState::kIncomplete) {
    fmt::print("calibration {} has {} of {} steps; go on with \"opaline calibrate --resume {}\"\n",
               record.version,
               record.steps.size(),
               calibration::kSteps.size(),
               rig);
    return ok();
  }
  const auto active = store.read_active();
  if (!active) return active.error();
  if (calibration::should_activate(record, *active)) {
    if (auto done = store.activate(record.version); !done) return done;
    fmt::print("calibration {} is accepted and active\n{}\n", record.version, file);
    return ok();
  }
  fmt::print(
      "calibration {0} is accepted but worse than the active {1} (largest figure {2:.0f} % of its "
      "limit, {3:.0f} % before): {1} stays active\n\"opaline calibration diff {1} {0}\" compares "
      "them, \"opaline calibration activate {0}\" takes it all the same\n",
      record.version,
      (*active)->version,
      100.0 * record.margin(),
      100.0 * (*active)->margin());
  return ok();
}

/// Beside the calibration; compared with the active one, or with the one before where it is that itself.
Result<void> write_report(const Record& record, const Store& store) {
  std::optional<Record> before;
  for (const int version : store.versions()) {
    if (version >= record.version) break;
    auto older = store.read(version);
    if (older && older->state() == RecordState::kAccepted) before = *std::move(older);
  }
  const fs::path path = store.directory_of(record.version) / "report.html";
  const std::string page = calibration_page(record, before, {});
  if (auto written = write_whole(system_files(), path, page); !written) return written;
  fmt::print("{}\n", path.string());
  return ok();
}

Result<void> run(const Arguments& arguments) {
  if (!arguments.step.empty()) {
    if (auto known = calibration::step_index(arguments.step); !known) return known.error();
  }
  const auto rig = config::load_rig(arguments.rig);
  if (!rig) return rig.error();
  const auto lock = lock_station(rig->station);
  if (!lock) return lock.error();
  const Store store(system_files(), fs::absolute(arguments.calibrations), rig->station);
  if (!arguments.view.empty()) return look(arguments, *rig, store);
  auto record = record_to_fill(store, arguments, rig->station);
  if (!record) return record.error();
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const SystemClock clock;
  ProgressView view(terminal_options(), clock);
  TerminalSink events(view);
  view.say(fmt::format("calibration {} of station {}", record->version, record->station));
  auto done = calibrate(*record, arguments, *rig, store, events, stop.get_token());
  if (!done && done.error().code == ErrorCode::kCancelled)
    return cancelled(fmt::format("stopped; go on with \"opaline calibrate --resume {}\"",
                                 arguments.rig.string()));
  if (!done) return done;
  if (auto written = write_report(*record, store); !written)
    fmt::print(stderr, "opaline-calibrate: {}\n", written.error().message);
  return conclude(*record, store, arguments.rig.string());
}

int program(int argc, char** argv) {
  CLI::App app(
      "Calibrates a station's camera and projector: warm_up, black_level, linearity, radiometric, "
      "geometry (where the rig file has a board), check; and colour, when asked for with a "
      "ColorChecker before the camera.\nEach step has "
      "gates; the first that fails ends it, and names what to mend.");
  Arguments arguments;
  app.add_option("RIG", arguments.rig, "rig.toml")->required();
  app.add_option("--step", arguments.step, "One step only, after those before it");
  app.add_flag("--resume", arguments.resume, "Go on with the newest unfinished one");
  app.add_option("--calibrations", arguments.calibrations, "Directory of all calibrations")
      ->capture_default_str();
  auto* const view = app.add_option(
      "--view", arguments.view, "A viewfinder instead: view.png and view.json in this directory");
  app.add_option("--frames", arguments.frames, "With --view: end after so many; 0: Ctrl-C ends it")
      ->check(CLI::NonNegativeNumber)
      ->needs(view);
  app.footer(
      "Ctrl-C stops; --resume goes on after the last step done.\nExit status: 0 done, 1 refused or "
      "failed, 2 bad input, 3 stopped, 4 station busy\n\nExamples:\n"
      "  opaline-calibrate config/sim-rig.toml\n"
      "  opaline-calibrate --resume config/sim-rig.toml\n"
      "  opaline-calibrate --step black_level config/sim-rig.toml\n"
      "  opaline-calibrate --view /tmp/view config/sim-rig.toml\n"
      "  opaline-calibrate --step colour config/sim-rig-chart.toml\n"
      "  opaline-calibrate config/sim-boards.toml");
  return run_command(app, "opaline-calibrate", argc, argv, [&] { return run(arguments); });
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_program(argc, argv, opaline::daemon::program);
}
