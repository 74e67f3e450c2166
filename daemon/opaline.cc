// opaline: the command line. Runs sessions, through the daemon or without one, and asks about them.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/log.h"
#include "config/session_config.h"
#include "daemon/cli/become.h"
#include "daemon/cli/calibration.h"
#include "daemon/cli/daemon_client.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/render.h"
#include "daemon/cli/run.h"
#include "daemon/cli/tradeoff.h"
#include "daemon/cli/view.h"
#include "daemon/executor.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/version.h"
#include "daemon/json_text.h"
#include "daemon/runtime_paths.h"
#include "daemon/session_factory.h"
#include "daemon/session_rules.h"
#include "daemon/token_file.h"

namespace {

using namespace opaline;          // NOLINT(google-build-using-namespace)
using namespace opaline::daemon;  // NOLINT(google-build-using-namespace)

constexpr int kLeft = 5;  // no longer followed, and not over; beside those of ProgramExit

struct CalibrateWish {
  std::string rig;
  std::string step;
  bool resume = false;
  std::string view;
  int frames = 0;
};

struct Arguments {
  DaemonAddress daemon;
  std::filesystem::path config;
  std::vector<std::filesystem::path> files;
  std::string id;
  std::string name;
  std::filesystem::path token_file;
  std::filesystem::path sessions = default_sessions();
  std::filesystem::path programs = program_directory();
  bool local = false;
  TradeoffWish tradeoff;
  CalibrateWish calibrate;
  CalibrationPlace calibrations{default_calibrations(), {}};
  std::vector<int> versions;
  RenderWish render;
  ViewWish view;
};

int report(const Error& error) {
  fmt::print(stderr, "opaline: {}\n", error.message);
  return status_of(Result<void>(error));
}

bool is_over_named(const std::string& state) {
  return state == "succeeded" || state == "failed" || state == "cancelled";
}

// `go_on`: how somebody who left goes on with the session.
int report(const Result<Ending>& ending, const std::string& go_on) {
  if (!ending) return report(ending.error());
  if (!is_over_named(ending->state)) {
    fmt::print("{}\n", go_on);
    return kLeft;
  }
  const std::filesystem::path page = ending->directory / "report.html";
  std::error_code none;
  fmt::print("session  {}\n", ending->directory.string());
  if (std::filesystem::exists(page, none)) fmt::print("report   {}\n", page.string());
  if (ending->state == "succeeded") return status_of(ProgramExit::kDone);
  fmt::print("{}{}{}\n", ending->state, ending->message.empty() ? "" : ": ", ending->message);
  return ending->state == "cancelled" ? status_of(ProgramExit::kCancelled)
                                      : status_of(ProgramExit::kFailed);
}

int follow(const Arguments& arguments, const std::string& id, OnInterrupt on_interrupt) {
  return report(follow_session(arguments.daemon, id, on_interrupt),
                fmt::format("session {0} goes on: \"opaline watch {0}\" shows it, \"opaline cancel "
                            "{0}\" stops it",
                            id));
}

int run_local(const Arguments& arguments, const SessionDirectory& session) {
  const std::string directory = session.path().string();
  fmt::print("session  {}\n", directory);
  std::fflush(stdout);
  return report(run_locally(session, arguments.programs, station_lock_of(session)),
                fmt::format("left; go on with \"opaline resume --local {}\"", directory));
}

int make_local(const Arguments& arguments, const SessionDirectory::Contents& contents) {
  const std::filesystem::path root = std::filesystem::absolute(arguments.sessions);
  if (auto made = system_files().make_directories(root); !made) return report(made.error());
  const auto session = make_session(system_files(), root, contents);
  return session ? run_local(arguments, *session) : report(session.error());
}

// The files are read here, and their texts sent: the daemon opens none of ours.
int run(const Arguments& arguments) {
  Result<SessionDirectory::Contents> contents = config::read_contents(arguments.config);
  if (!contents) return report(contents.error());
  if (!arguments.name.empty()) contents->name = arguments.name;
  if (arguments.local) return make_local(arguments, *contents);
  const auto created = DaemonClient(arguments.daemon)
                           .post("/v1/sessions",
                                 {{"name", contents->name},
                                  {"session", contents->session_toml},
                                  {"rig", contents->rig_toml},
                                  {"resolved", contents->resolved_toml}});
  if (!created) return report(created.error());
  const std::string id = text_of(*created, "id");
  if (id.empty()) return report(internal_error("the daemon's answer names no session"));
  fmt::print("session  {}\n", id);
  return follow(arguments, id, OnInterrupt::kCancel);
}

int resume_local(const Arguments& arguments) {
  const auto session = SessionDirectory::open(std::filesystem::absolute(arguments.id));
  if (!session) return report(session.error());
  if (auto resumed = resume_locally(*session); !resumed) return report(resumed.error());
  return run_local(arguments, *session);
}

int check(const Arguments& arguments) {
  int status = status_of(ProgramExit::kDone);
  for (const std::filesystem::path& file : arguments.files) {
    const auto problems = config::check(file);
    if (!problems) {
      status = report(problems.error());
    } else if (problems->empty()) {
      fmt::print("{}: no problems\n", file.string());
    } else {
      fmt::print(stderr, "{}\n", config::to_string(*problems));
      status = status_of(ProgramExit::kBadInput);
    }
  }
  return status;
}

void print_active(const nlohmann::json& session) {
  const auto progress = session.find("progress");
  const bool moves = progress != session.end() && progress->is_object();
  fmt::print(
      "{}  {}  {}\n",
      text_of(session, "id"),
      text_of(session, "state"),
      moves ? progress_line(text_of(session, "stage"), *progress) : text_of(session, "message"));
}

nlohmann::json list_in(const nlohmann::json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_array() ? *it : nlohmann::json::array();
}

int status(const Arguments& arguments) {
  const DaemonClient client(arguments.daemon);
  const auto all = client.get("/v1/sessions");
  if (!all) return report(all.error());
  const auto now = client.get("/v1/status");
  if (!now) return report(now.error());
  fmt::print("opalined {}, sessions in {}\n",
             text_of(*now, "version"),
             text_of(*now, "sessions_directory"));
  for (const auto& session : list_in(*now, "active")) print_active(session);
  for (const auto& session : list_in(*all, "sessions")) {
    const std::string state = text_of(session, "state");
    if (is_over_named(state)) fmt::print("{}  {}\n", text_of(session, "id"), state);
  }
  return status_of(ProgramExit::kDone);
}

int post(const Arguments& arguments, const std::string& what) {
  const auto answer = DaemonClient(arguments.daemon)
                          .post(fmt::format("/v1/sessions/{}/{}", arguments.id, what), {});
  if (!answer) return report(answer.error());
  fmt::print("{}  {}\n", arguments.id, text_of(*answer, "state"));
  return status_of(ProgramExit::kDone);
}

// What a subcommand does, after what each of them needs first.
std::function<void()> command(Arguments& arguments, int& status_code, std::function<int()> action) {
  return [&arguments, &status_code, action = std::move(action)] {
    if (!arguments.token_file.empty()) {
      const Result<std::string> token = read_token(arguments.token_file);
      if (!token) {
        status_code = report(token.error());
        return;
      }
      arguments.daemon.token = *token;
    }
    status_code = action();
  };
}

void declare_local(CLI::App& command, Arguments& arguments, const char* help) {
  command.add_flag("--local", arguments.local, help);
  command
      .add_option("--programs",
                  arguments.programs,
                  "With --local: directory of opaline-capture and its siblings")
      ->capture_default_str();
}

void declare_run(CLI::App& app, Arguments& arguments, int& status_code) {
  CLI::App* run_command =
      app.add_subcommand("run", "Make a session from a configuration and follow it to its report");
  run_command->add_option("CONFIG", arguments.config, "session.toml")->required();
  run_command->add_option(
      "--name", arguments.name, "The session's name, in place of the configuration's");
  declare_local(*run_command, arguments, "Without a daemon");
  run_command
      ->add_option(
          "--sessions", arguments.sessions, "With --local: directory of the session directories")
      ->capture_default_str();
  run_command->footer(
      "Ctrl-C cancels the session; a second one leaves it running.\nExit status: 0 done, 1 failed, "
      "2 bad configuration, 3 cancelled, 4 busy, 5 left running\n\nExamples:\n  opaline run "
      "config/sim.toml --name \"blue wax\"\n  opaline run --local --sessions ~/sessions "
      "config/sim.toml");
  run_command->callback(command(arguments, status_code, [&] { return run(arguments); }));
}

void declare_questions(CLI::App& app, Arguments& arguments, int& status_code) {
  CLI::App* sub = app.add_subcommand("check", "Find every problem of session and rig files");
  sub->add_option("FILE", arguments.files, "session.toml or rig.toml")->required();
  sub->footer(
      "Exit status: 0 no problems, 2 problems\n\nExample: opaline check session.toml rig.toml");
  sub->callback(command(arguments, status_code, [&] { return check(arguments); }));
  sub = app.add_subcommand("status", "What the daemon has and does");
  sub->footer(
      "Examples:\n  opaline status\n  opaline --url http://station:8787 --token-file "
      "~/.opaline-token status");
  sub->callback(command(arguments, status_code, [&] { return status(arguments); }));
}

void declare_deeds(CLI::App& app, Arguments& arguments, int& status_code) {
  const auto add = [&](const char* name, const char* help, std::function<int()> action) {
    CLI::App* sub = app.add_subcommand(name, help);
    sub->add_option("ID", arguments.id, "The session, as \"opaline status\" lists it")->required();
    sub->footer(fmt::format("Example: opaline {} 20260131-123456-ab12cd-marble", name));
    sub->callback(command(arguments, status_code, std::move(action)));
    return sub;
  };
  add("watch", "Follow a session to its end; Ctrl-C leaves it to the daemon", [&] {
    return follow(arguments, arguments.id, OnInterrupt::kLeave);
  });
  add("cancel", "Stop a session cleanly", [&] { return post(arguments, "cancel"); });
  CLI::App* resume = add("resume", "Try again what failed or was cancelled", [&] {
    return arguments.local ? resume_local(arguments) : post(arguments, "resume");
  });
  declare_local(*resume, arguments, "Without a daemon: ID is the session's directory");
  resume->footer(
      "Examples:\n  opaline resume 20260131-123456-ab12cd-marble\n  opaline resume --local "
      "~/sessions/20260131-123456-ab12cd-marble");
}

void declare_tradeoff(CLI::App& app, Arguments& arguments, int& status_code) {
  TradeoffWish& wish = arguments.tradeoff;
  CLI::App* sub = app.add_subcommand(
      "tradeoff",
      "Measure seconds against accuracy on a session's own pictures, setting by setting");
  sub->add_option("DIR", wish.directory, "A session directory, or one with a dataset")->required();
  sub->add_option(
      "--out", wish.out, "Directory for tradeoff.csv and tradeoff.svg; default DIR/tradeoff");
  sub->add_flag("--quick", wish.quick, "Only what takes seconds");
  sub->add_option("--limit", wish.limit_seconds, "Seconds after which a setting is given up")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->footer(
      "Ctrl-C stops and keeps what was measured. What the settings mean: "
      "docs/accuracy.md\n\nExamples:\n"
      "  opaline tradeoff ~/sessions/20260131-123456-ab12cd-marble\n"
      "  opaline tradeoff --quick --out /tmp/front ~/sessions/20260131-123456-ab12cd-marble");
  sub->callback([&] { status_code = report(become_tradeoff(arguments.programs, wish)); });
}

void declare_render(CLI::App& app, Arguments& arguments, int& status_code) {
  RenderWish& wish = arguments.render;
  CLI::App* sub = app.add_subcommand(
      "render", "Draw a scene of translucent and opaque objects, without a daemon");
  sub->add_option("SCENE", wish.scene, "scene.toml (docs/rendering.md)")->required();
  sub->add_option("--output,-o", wish.outputs, "Picture: .png, .tif or .exr; may be given again")
      ->required();
  sub->add_option("--turntable",
                  wish.turntable,
                  "This many pictures of the objects' full turn, numbered NAME_000 and on")
      ->check(CLI::Range(0, 100000));
  sub->add_option("--stats", wish.stats, "File for the statistics as JSON, in place of text");
  sub->add_option(
         "--draw", wish.draw, "host: rays on the processor; vulkan: rasteriser and shadow maps")
      ->check(CLI::IsMember({"host", "vulkan"}))
      ->capture_default_str();
  sub->add_option("--device", wish.device, "Part of the name of the Vulkan device that draws");
  sub->add_option("--save-material",
                  wish.materials,
                  "OBJECT=FILE.vdb: the object's material with its edits; may be given again");
  sub->add_flag("--no-edits", wish.no_edits, "Leave out the edits of the scene");
  sub->add_flag("--at-rest", wish.at_rest, "Leave out the bending of the scene");
  sub->add_flag("--swing",
                wish.swing,
                "Over a turntable objects bend from rest to where the scene has them, and back");
  sub->add_option("--threads", wish.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  sub->footer(
      "Ctrl-C stops; a picture is there whole or not at all.\n"
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline render config/scene_marble_torus.toml --output torus.png\n"
      "  opaline render scene.toml --output frame.png --output frame.exr --turntable 60\n"
      "  opaline render scene.toml --output picture.png --stats picture.json\n"
      "  opaline render scene.toml --output bend.png --turntable 24 --swing\n"
      "  opaline render scene.toml --output after.png --save-material ring=painted.vdb");
  sub->callback([&] { status_code = report(become_render(arguments.programs, wish)); });
}

void declare_view(CLI::App& app, Arguments& arguments, int& status_code) {
  ViewWish& wish = arguments.view;
  CLI::App* sub = app.add_subcommand(
      "view", "Open a window on a scene: light it, paint into it, bend it, without a daemon");
  sub->add_option("SCENE", wish.scene, "scene.toml (docs/rendering.md)")->required();
  sub->add_option("--do", wish.actions, "Does this, one thing a picture; may be given again");
  sub->add_option("--frames", wish.frames, "Ends after this many pictures")
      ->check(CLI::Range(0, 1'000'000));
  sub->add_option("--screenshot", wish.screenshot, "PNG of the window before it ends");
  sub->add_option("--width", wish.width, "Of the window, pixels")->check(CLI::Range(64, 8192));
  sub->add_option("--height", wish.height, "Of the window, pixels")->check(CLI::Range(64, 8192));
  sub->add_option("--device", wish.device, "Part of the name of the Vulkan device");
  sub->add_flag("--validation", wish.validation, "Vulkan's validation layer; what it says fails");
  sub->add_option("--threads", wish.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  sub->footer(
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline view config/scene_marble_torus.toml\n"
      "  opaline view scene.toml --do 'brush radius 2' --do 'paint 0.5 0.6' --do 'screenshot "
      "a.png'\n"
      "  opaline view scene.toml --frames 5 --screenshot window.png");
  sub->callback([&] { status_code = report(become_view(arguments.programs, wish)); });
}

Error become_calibrate(const Arguments& arguments) {
  const CalibrateWish& wish = arguments.calibrate;
  std::vector<std::string> words{"--calibrations", arguments.calibrations.root.string()};
  if (!wish.step.empty()) words.insert(words.end(), {"--step", wish.step});
  if (wish.resume) words.emplace_back("--resume");
  if (!wish.view.empty())
    words.insert(words.end(), {"--view", wish.view, "--frames", std::to_string(wish.frames)});
  words.insert(words.end(), {"--", wish.rig});
  return become(arguments.programs, "opaline-calibrate", words);
}

void declare_place(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--calibrations", arguments.calibrations.root, "Directory of all calibrations")
      ->capture_default_str();
}

void declare_calibrate(CLI::App& app, Arguments& arguments, int& status_code) {
  CalibrateWish& wish = arguments.calibrate;
  CLI::App* sub = app.add_subcommand(
      "calibrate", "Let a station measure its camera and projector before it measures a sample");
  sub->add_option("RIG", wish.rig, "rig.toml")->required();
  sub->add_option("--step",
                  wish.step,
                  "One step only: warm_up, black_level, linearity, radiometric, check; or colour");
  sub->add_flag("--resume", wish.resume, "Go on with the newest unfinished one");
  auto* const view = sub->add_option(
      "--view", wish.view, "A viewfinder instead: view.png and view.json in this directory");
  sub->add_option("--frames", wish.frames, "With --view: end after so many; 0: Ctrl-C ends it")
      ->check(CLI::NonNegativeNumber)
      ->needs(view);
  declare_place(*sub, arguments);
  sub->footer(
      "Each step has gates; the first that fails ends it and names what to mend. What is measured: "
      "docs/calibration.md\nExit status: 0 done, 1 refused or failed, 2 bad input, 3 stopped, 4 "
      "station busy\n\nExamples:\n"
      "  opaline calibrate config/sim-rig.toml\n"
      "  opaline calibrate --resume config/sim-rig.toml\n"
      "  opaline calibrate --step black_level config/sim-rig.toml\n"
      "  opaline calibrate --view /tmp/view config/sim-rig.toml");
  sub->callback([&] { status_code = report(become_calibrate(arguments)); });
}

int report(const Result<void>& done) {
  return done ? status_of(ProgramExit::kDone) : report(done.error());
}

void declare_calibration(CLI::App& app, Arguments& arguments, int& status_code) {
  CLI::App* group =
      app.add_subcommand("calibration", "The calibrations of a station, and which one is used");
  group->require_subcommand(1);
  group->fallthrough();
  declare_place(*group, arguments);
  group->add_option(
      "--station", arguments.calibrations.station, "Where there are several: [station] name");
  const auto add = [&](const char* name, const char* help, std::function<Result<void>()> action) {
    CLI::App* sub = group->add_subcommand(name, help);
    sub->callback([&status_code, action = std::move(action)] { status_code = report(action()); });
    return sub;
  };
  const CalibrationPlace& place = arguments.calibrations;
  add("list", "All, with the one in use", [&] { return list_calibrations(place); });
  add("show",
      "One with its steps, gates and figures",
      [&] {
        return show_calibration(place, arguments.versions.empty() ? 0 : arguments.versions[0]);
      })
      ->add_option("VERSION", arguments.versions, "Default: the active one")
      ->expected(0, 1);
  add("activate",
      "Use this one from now on, also an older one",
      [&] { return activate_calibration(place, arguments.versions[0]); })
      ->add_option("VERSION", arguments.versions, "As \"opaline calibration list\" has it")
      ->required()
      ->expected(1);
  add("diff",
      "What changed between two",
      [&] { return diff_calibrations(place, arguments.versions[0], arguments.versions[1]); })
      ->add_option("BEFORE AFTER", arguments.versions, "Two versions")
      ->required()
      ->expected(2);
  group->footer(
      "Examples:\n  opaline calibration list\n  opaline calibration show 3\n  opaline calibration "
      "activate 2      roll back\n  opaline calibration diff 2 3");
}

void declare(CLI::App& app, Arguments& arguments, int& status_code) {
  app.description(
      "Captures translucent materials: one configuration in, a material and its report out.");
  app.add_option("--socket",
                 arguments.daemon.socket,
                 "The daemon's Unix socket; default $OPALINE_SOCKET or opaline/opalined.sock in "
                 "the runtime directory");
  app.add_option("--url", arguments.daemon.url, "A daemon on another machine: http://HOST:PORT");
  app.add_option("--token-file", arguments.token_file, "File with its token")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--token", arguments.daemon.token, "Its token, for every user of this machine to see")
      ->envname("OPALINE_TOKEN");
  app.set_version_flag("--version", std::string("opaline ") + std::string(version()));
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(
      "Examples:\n"
      "  opaline run config/sim.toml            through the daemon (start it with \"opalined\")\n"
      "  opaline run --local config/sim.toml    without one\n"
      "  opaline check session.toml rig.toml    every problem, with file, line and column\n"
      "  opaline status                         what runs\n"
      "  opaline watch 20260131-123456-ab12cd-marble\n"
      "  opaline render config/scene_marble_torus.toml --output torus.png");
  declare_run(app, arguments, status_code);
  declare_questions(app, arguments, status_code);
  declare_deeds(app, arguments, status_code);
  declare_tradeoff(app, arguments, status_code);
  declare_calibrate(app, arguments, status_code);
  declare_calibration(app, arguments, status_code);
  declare_render(app, arguments, status_code);
  declare_view(app, arguments, status_code);
}

int program(int argc, char** argv) {
  CLI::App app;
  Arguments arguments;
  int status_code = status_of(ProgramExit::kDone);
  log::set_level(log::Level::kWarning);  // what happens is shown by the progress
  if (const auto socket = default_socket()) arguments.daemon.socket = *socket;
  declare(app, arguments, status_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? status_of(ProgramExit::kDone) : status_of(ProgramExit::kBadInput);
  }
  return status_code;
}

}  // namespace

int main(int argc, char** argv) { return opaline::daemon::run_program(argc, argv, program); }
