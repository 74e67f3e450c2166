// opaline-calibrate: takes a station through its calibration, step by step.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ranges>
#include <string>
#include <variant>
#include <vector>

#include "base/clock.h"
#include "base/files.h"
#include "base/io/image_io.h"
#include "calibration/measured_station.h"
#include "calibration/procedure.h"
#include "calibration/store.h"
#include "config/session_config.h"
#include "daemon/calibrate/calibration_report.h"
#include "daemon/calibrate/calibration_terminal.h"
#include "daemon/calibrate/guarded_station.h"
#include "daemon/calibrate/live_attendant.h"
#include "daemon/calibrate/pose_picture.h"
#include "daemon/calibrate/view.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/terminal.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "daemon/live_view.h"
#include "daemon/runtime_paths.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using calibration::Record;
using calibration::RecordState;
using calibration::Store;

constexpr std::size_t kLargestPose = 64u << 20;
constexpr int kThumbnailWidth = 240;
constexpr int kThumbnailsAcross = 4;

struct Arguments {
  fs::path rig;
  std::string step;
  bool resume = false;
  bool attended = false;  ///< a person holds the board, also before a simulated station
  fs::path view;          ///< a viewfinder instead of a calibration, with files here
  bool live = false;      ///< a viewfinder without files
  int frames = 0;         ///< of it; 0: until it is stopped
  int while_watched =
      0;  ///< seconds without anybody looking at the live view that end it; 0: none do
  fs::path calibrations = default_calibrations();
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

/// Pictures for the daemon's clients; without a place for them a calibration does without.
std::unique_ptr<LiveView> live_view(const std::string& station) {
  const auto root = live_root();
  auto live = root ? LiveView::create(system_files(), live_directory(*root, station))
                   : Result<std::unique_ptr<LiveView>>(root.error());
  if (live) return *std::move(live);
  fmt::print(stderr, "opaline-calibrate: no live view: {}\n", live.error().message);
  return nullptr;
}

/// Black and clipping as calibrated last, or as the rig file has them.
capture::StationCalibration believed(const config::RigConfig& rig, const Store& store) {
  const auto active = store.read_active();
  if (active && *active) return calibration::with_measured(rig.calibration, (*active)->measured);
  return rig.calibration;
}

LiveAttendant::Options attendant_options(const Arguments& arguments,
                                         const config::RigConfig& rig,
                                         const Store& store,
                                         LiveView* live,
                                         int version) {
  const auto camera = believed(rig, store).camera;
  return {live,
          store.directory_of(version) / "poses",
          version,
          arguments.attended || !rig.is_simulated(),
          camera.black_level,
          capture::clipping_code(camera)};
}

Result<void> calibrate(Record& record,
                       const Arguments& arguments,
                       const config::RigConfig& rig,
                       const Store& store,
                       ProgressView& view,
                       const std::stop_token& asked) {
  const std::unique_ptr<LiveView> live = live_view(rig.station);
  LiveAttendant attendant(attendant_options(arguments, rig, store, live.get(), record.version),
                          system_files());
  CalibrationTerminal events(view, &attendant, terminal_options().terminal);
  calibration::ProcedureOptions options;
  if (!arguments.step.empty()) options.only = arguments.step;
  options.geometry = rig.geometry;
  options.attendant = &attendant;
  if (rig.geometry.has_board() && attendant.holds_the_board())
    view.say(
        "a pose is taken once the board has been moved and stands still; Enter takes it as it "
        "is, \"enough\" ends the poses");
  return with_station(arguments.rig,
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

Result<void> look(const Arguments& arguments, const config::RigConfig& rig, const Store& store) {
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const std::unique_ptr<LiveView> live = live_view(rig.station);
  const auto camera = believed(rig, store).camera;
  ViewOptions options;
  if (!arguments.view.empty()) options.directory = fs::absolute(arguments.view);
  options.live = live.get();
  if (arguments.while_watched > 0) options.while_watched.emplace(arguments.while_watched);
  options.frames = arguments.frames;
  options.black = camera.black_level;
  options.clipping = capture::clipping_code(camera);
  const fs::path shown = options.directory.empty() && live ? live->directory() : options.directory;
  fmt::print("{}\n", (shown / "view.png").string());
  NullSink events;
  const auto say = [](const std::string& line) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
  };
  const fs::path place = shown / ".station";  // of another rig, perhaps
  std::error_code none;
  fs::remove_all(place, none);
  return with_station(arguments.rig,
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

/// The pictures of its poses on one sheet; nothing where there are none.
std::vector<std::byte> poses_sheet(const fs::path& poses) {
  std::vector<Image<std::uint8_t>> pictures;
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(poses, none)) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    const auto bytes = read_bytes(file, kLargestPose);
    const auto image = bytes ? decode_image(*bytes) : Result<ImageFile>(bytes.error());
    const auto* pixels = image ? std::get_if<Image<std::uint8_t>>(&image->pixels) : nullptr;
    if (pixels != nullptr && pixels->channels() == 3)
      pictures.push_back(shrunk(*pixels, kThumbnailWidth));
  }
  const Image<std::uint8_t> sheet = contact_sheet(pictures, kThumbnailsAcross);
  if (sheet.empty()) return {};
  auto png = encode_image({sheet, {}, {}}, ImageFormat::kPng);
  return png ? *std::move(png) : std::vector<std::byte>();
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
  const std::string page = calibration_page(
      record, before, poses_sheet(store.directory_of(record.version) / "poses"), {});
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
  if (arguments.live || !arguments.view.empty()) return look(arguments, *rig, store);
  auto record = record_to_fill(store, arguments, rig->station);
  if (!record) return record.error();
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const SystemClock clock;
  ProgressView view(terminal_options(), clock);
  view.say(fmt::format("calibration {} of station {}", record->version, record->station));
  auto done = calibrate(*record, arguments, *rig, store, view, stop.get_token());
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
  auto* const live = app.add_flag(
      "--live", arguments.live, "A viewfinder for the daemon's clients only, without a directory");
  live->excludes(view);
  app.add_option(
         "--frames", arguments.frames, "Of a viewfinder: end after so many; 0: Ctrl-C ends it")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--while-watched",
                 arguments.while_watched,
                 "Of a viewfinder: end once nobody has looked at it over HTTP for so many seconds")
      ->check(CLI::PositiveNumber);
  app.add_flag("--attended",
               arguments.attended,
               "Wait for a person to move the board also before a simulated station");
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
