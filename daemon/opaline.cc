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
#include "daemon/cli/calibration_commands.h"
#include "daemon/cli/daemon_client.h"
#include "daemon/cli/error_report.h"
#include "daemon/cli/program_commands.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/run.h"
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
  CalibrationCommands calibration{default_calibrations()};
  ProgramCommands programs_behind;
};

bool is_over_named(const std::string& state) {
  return state == "succeeded" || state == "failed" || state == "cancelled";
}

// `go_on`: how somebody who left goes on with the session.
int report_ending(const Result<Ending>& ending, const std::string& go_on) {
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
  return report_ending(
      follow_session(arguments.daemon, id, on_interrupt),
      fmt::format("session {0} goes on: \"opaline watch {0}\" shows it, \"opaline cancel "
                  "{0}\" stops it",
                  id));
}

int run_local(const Arguments& arguments, const SessionDirectory& session) {
  const std::string directory = session.path().string();
  fmt::print("session  {}\n", directory);
  std::fflush(stdout);
  return report_ending(run_locally(session, arguments.programs, station_lock_of(session)),
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
  arguments.calibration.declare(app, arguments.programs, status_code);
  arguments.programs_behind.declare(app, arguments.programs, status_code);
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
