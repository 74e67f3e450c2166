// opaline: the command line. Runs sessions, through the daemon or without one, and asks about them.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/log.h"
#include "config/session_config.h"
#include "daemon/cli/daemon_client.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/run.h"
#include "daemon/executor.h"
#include "daemon/jobs/version.h"
#include "daemon/runtime_paths.h"
#include "daemon/session_factory.h"
#include "daemon/session_rules.h"

namespace {

using namespace opaline;          // NOLINT(google-build-using-namespace)
using namespace opaline::daemon;  // NOLINT(google-build-using-namespace)

enum Exit : int { kDone = 0, kFailed = 1, kBadInput = 2, kCancelledByUser = 3, kBusyNow = 4 };

struct Arguments {
  DaemonAddress daemon;
  std::filesystem::path config;
  std::vector<std::filesystem::path> files;
  std::string id;
  std::string name;
  std::filesystem::path sessions = default_sessions();
  std::filesystem::path programs = program_directory();
  bool local = false;
};

int report(const Error& error) {
  fmt::print(stderr, "opaline: {}\n", error.message);
  switch (error.code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kNotFound:
      return kBadInput;
    case ErrorCode::kCancelled:
      return kCancelledByUser;
    case ErrorCode::kBusy:
      return kBusyNow;
    default:
      return kFailed;
  }
}

int report(const Result<Ending>& ending) {
  if (!ending) return report(ending.error());
  const std::filesystem::path page = ending->directory / "report.html";
  std::error_code none;
  fmt::print("session  {}\n", ending->directory.string());
  if (std::filesystem::exists(page, none)) fmt::print("report   {}\n", page.string());
  if (ending->state == "succeeded") return kDone;
  fmt::print("{}{}{}\n", ending->state, ending->message.empty() ? "" : ": ", ending->message);
  return ending->state == "cancelled" ? kCancelledByUser : kFailed;
}

// The files are read here, and their texts sent: the daemon opens none of ours.
int run(const Arguments& arguments) {
  Result<SessionDirectory::Contents> contents = config::read_contents(arguments.config);
  if (!contents) return report(contents.error());
  if (!arguments.name.empty()) contents->name = arguments.name;
  if (arguments.local) {
    const std::filesystem::path root = std::filesystem::absolute(arguments.sessions);
    if (auto made = system_files().make_directories(root); !made) return report(made.error());
    const auto session = make_session(system_files(), root, *contents);
    if (!session) return report(session.error());
    return report(run_locally(*session, arguments.programs, station_lock_of(*session)));
  }
  const auto created = DaemonClient(arguments.daemon)
                           .post("/v1/sessions",
                                 {{"name", contents->name},
                                  {"session", contents->session_toml},
                                  {"rig", contents->rig_toml},
                                  {"resolved", contents->resolved_toml}});
  if (!created) return report(created.error());
  fmt::print("session  {}\n", created->value("id", ""));
  return report(follow_session(arguments.daemon, created->value("id", "")));
}

int check(const Arguments& arguments) {
  int status = kDone;
  for (const std::filesystem::path& file : arguments.files) {
    const auto problems = config::check(file);
    if (!problems) {
      status = report(problems.error());
    } else if (problems->empty()) {
      fmt::print("{}: no problems\n", file.string());
    } else {
      fmt::print(stderr, "{}\n", config::to_string(*problems));
      status = kBadInput;
    }
  }
  return status;
}

void print_active(const nlohmann::json& session) {
  const std::string state = session.value("state", "");
  const auto progress = session.value("progress", nlohmann::json());
  fmt::print("{}  {}  {}\n",
             session.value("id", ""),
             state,
             progress.is_object() ? progress_line(session.value("stage", ""), progress)
                                  : session.value("message", ""));
}

int status(const Arguments& arguments) {
  const DaemonClient client(arguments.daemon);
  const auto all = client.get("/v1/sessions");
  if (!all) return report(all.error());
  const auto now = client.get("/v1/status");
  if (!now) return report(now.error());
  fmt::print("opalined {}, sessions in {}\n",
             now->value("version", ""),
             now->value("sessions_directory", ""));
  for (const auto& session : now->value("active", nlohmann::json::array())) print_active(session);
  for (const auto& session : all->value("sessions", nlohmann::json::array())) {
    const std::string state = session.value("state", "");
    if (state != "succeeded" && state != "failed" && state != "cancelled") continue;
    fmt::print("{}  {}\n", session.value("id", ""), state);
  }
  return kDone;
}

int post(const Arguments& arguments, const std::string& what) {
  const auto answer = DaemonClient(arguments.daemon)
                          .post(fmt::format("/v1/sessions/{}/{}", arguments.id, what), {});
  if (!answer) return report(answer.error());
  fmt::print("{}  {}\n", arguments.id, answer->value("state", ""));
  return kDone;
}

void declare_run(CLI::App& app, Arguments& arguments, int& status_code) {
  CLI::App* command =
      app.add_subcommand("run", "Make a session from a configuration and follow it to its report");
  command->add_option("CONFIG", arguments.config, "session.toml")->required();
  command->add_option(
      "--name", arguments.name, "The session's name, in place of the configuration's");
  command->add_flag("--local", arguments.local, "Without a daemon");
  command
      ->add_option(
          "--sessions", arguments.sessions, "With --local: directory of the session directories")
      ->capture_default_str();
  command
      ->add_option("--programs",
                   arguments.programs,
                   "With --local: directory of opaline-capture and its siblings")
      ->capture_default_str();
  command->footer(
      "Ctrl-C cancels the session; a second one leaves it running.\nExit status: 0 done, 1 failed, "
      "2 bad configuration, 3 cancelled, 4 busy");
  command->callback([&] { status_code = run(arguments); });
}

void declare_others(CLI::App& app, Arguments& arguments, int& status_code) {
  CLI::App* command = app.add_subcommand("check", "Find every problem of session and rig files");
  command->add_option("FILE", arguments.files, "session.toml or rig.toml")->required();
  command->callback([&] { status_code = check(arguments); });
  command = app.add_subcommand("status", "What the daemon has and does");
  command->callback([&] { status_code = status(arguments); });
  const auto with_id = [&](const char* name, const char* help, std::function<int()> action) {
    CLI::App* sub = app.add_subcommand(name, help);
    sub->add_option("ID", arguments.id, "The session, as \"opaline status\" lists it")->required();
    sub->callback([&status_code, action = std::move(action)] { status_code = action(); });
  };
  with_id("watch", "Follow a session to its end", [&] {
    return report(follow_session(arguments.daemon, arguments.id));
  });
  with_id("cancel", "Stop a session cleanly", [&] { return post(arguments, "cancel"); });
  with_id("resume", "Try again what failed or was cancelled", [&] {
    return post(arguments, "resume");
  });
}

void declare(CLI::App& app, Arguments& arguments, int& status_code) {
  app.description(
      "Captures translucent materials: one configuration in, a material and its report out.");
  app.add_option("--socket",
                 arguments.daemon.socket,
                 "The daemon's Unix socket; default $OPALINE_SOCKET or opaline/opalined.sock in "
                 "the runtime directory");
  app.add_option("--url", arguments.daemon.url, "A daemon on another machine: http://HOST:PORT");
  app.add_option("--token", arguments.daemon.token, "Its token")->envname("OPALINE_TOKEN");
  app.set_version_flag("--version", std::string("opaline ") + std::string(version()));
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(
      "Examples:\n"
      "  opaline run config/sim.toml            through the daemon (start it with \"opalined\")\n"
      "  opaline run --local config/sim.toml    without one\n"
      "  opaline check session.toml rig.toml    every problem, with file, line and column\n"
      "  opaline status                         what runs\n"
      "  opaline watch 20260131-123456-ab12cd-marble");
  declare_run(app, arguments, status_code);
  declare_others(app, arguments, status_code);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app;
  Arguments arguments;
  int status_code = kDone;
  log::set_level(log::Level::kWarning);  // what happens is shown by the progress
  if (const auto socket = default_socket()) arguments.daemon.socket = *socket;
  declare(app, arguments, status_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kBadInput;
  }
  return status_code;
}
