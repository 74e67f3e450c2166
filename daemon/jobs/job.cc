#include "daemon/jobs/job.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <optional>
#include <string_view>

#include "base/clock.h"
#include "base/event_log.h"
#include "base/lock.h"
#include "base/log.h"
#include "daemon/jobs/control_server.h"
#include "daemon/jobs/job_events.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"

namespace opaline::daemon {
namespace {

void print_help(const JobDescription& job) {
  fmt::print(
      "Usage: opaline-{0} SESSION_DIR\n\n{1}\n\n"
      "  -h, --help     this text\n"
      "      --version  the version\n\n"
      "Does what the session's {0} stage still lacks; started again after a crash it goes on.\n"
      "SIGTERM and Ctrl-C stop it cleanly. The session's events.jsonl says how it went.\n\n"
      "Exit status: 0 done, 1 failed, 2 bad usage or input, 3 cancelled, 4 session or station "
      "busy\n\nExample: opaline-{0} sessions/20260131-123456-ab12cd-marble\n",
      job.name,
      job.summary);
}

// The session directory, or the status to end with.
struct Arguments {
  std::optional<int> exit;
  std::string directory;
};

Arguments parse_arguments(int argc, char** argv, const JobDescription& job) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    print_help(job);
    return {status_of(ProgramExit::kDone), {}};
  }
  if (first == "--version") {
    fmt::print("opaline-{} {}\n", job.name, version());
    return {status_of(ProgramExit::kDone), {}};
  }
  if (argc != 2 || first.empty() || first.starts_with('-')) {
    fmt::print(stderr, "Usage: opaline-{0} SESSION_DIR (see opaline-{0} --help)\n", job.name);
    return {status_of(ProgramExit::kBadInput), {}};
  }
  return {std::nullopt, std::string(first)};
}

enum class StopReason : int { kNone, kRequest, kSignal };

/// One run of a job on its locked session.
class JobRun {
 public:
  JobRun(const JobDescription& job, const SessionDirectory& session, EventLog& log)
      : job_(job), session_(session), log_(log), events_(log, clock_) {}

  Result<void> run(const JobBody& body) {
    auto signals = StopSignals::watch([this](int signal) {
      stop(signal == SIGINT ? StopReason::kRequest : StopReason::kSignal);
    });
    if (!signals) return signals.error();
    if (auto logged = log_started(); !logged) return logged;
    auto control = ControlServer::start(session_.control_socket(),
                                        [this](const auto& request) { return answer(request); });
    Result<void> result = control ? call(body) : Result<void>(control.error());
    if (auto logged = log_finished(result); !logged) {
      log::error("opaline-{}: how it ended is not logged: {}", job_.name, logged.error().message);
      if (result) return logged;
    }
    return result;
  }

 private:
  Result<void> log_started() {
    return events_.fact("job.started",
                        {{"job", job_.name}, {"pid", ::getpid()}, {"version", version()}});
  }

  Result<void> call(const JobBody& body) {
    JobContext context{session_, events_, system_files(), stop_.get_token()};
    try {
      return body(context);
    } catch (const std::exception& e) {  // a thrown error of a library is our fault, not a crash
      return internal_error(e.what());
    }
  }

  Result<void> log_finished(const Result<void>& result) {
    nlohmann::json data{{"job", job_.name}, {"outcome", "succeeded"}, {"message", ""}};
    if (!result) {
      const bool was_cancelled = result.error().code == ErrorCode::kCancelled;
      data["outcome"] = was_cancelled ? "cancelled" : "failed";
      data["code"] = to_string(result.error().code);
      data["message"] = result.error().message;
      if (was_cancelled) data["by"] = reason_ == StopReason::kSignal ? "signal" : "request";
    }
    return events_.fact("job.finished", data);
  }

  void stop(StopReason reason) {
    StopReason none = StopReason::kNone;
    reason_.compare_exchange_strong(none, reason);
    stop_.request_stop();
  }

  // The wish outlives a job that dies before it could follow it.
  nlohmann::json cancel() {
    stop(StopReason::kRequest);
    if (auto logged = events_.fact("job.cancel_requested", {{"job", job_.name}}); !logged) {
      log::warning("cancel request not logged: {}", logged.error().message);
    }
    return {{"ok", true}};
  }

  nlohmann::json answer(const nlohmann::json& request) {
    const auto it = request.find("command");
    const std::string command =
        it != request.end() && it->is_string() ? it->get<std::string>() : std::string();
    if (command == "cancel") return cancel();
    if (command == "status") {
      return {{"ok", true},
              {"job", job_.name},
              {"pid", ::getpid()},
              {"progress", events_.latest_progress()}};
    }
    return control_error(
        invalid_argument(fmt::format("command \"{}\"; known are cancel, status", command)));
  }

  const JobDescription& job_;
  const SessionDirectory& session_;
  EventLog& log_;
  SystemClock clock_;
  JobEvents events_;
  std::stop_source stop_;
  std::atomic<StopReason> reason_ = StopReason::kNone;
};

Result<void> run_on(const std::string& directory, const JobDescription& job, const JobBody& body) {
  const Result<SessionDirectory> session = SessionDirectory::open(directory);
  if (!session) return session.error();
  const Result<FileLock> lock = FileLock::acquire(session->lock());
  if (!lock && lock.error().code == ErrorCode::kBusy) {
    return busy(fmt::format("another job works on session {}", session->path().string()));
  }
  if (!lock) return lock.error();
  const auto log = EventLog::open(system_files(), session->events());
  if (!log) return log.error();
  return JobRun(job, *session, **log).run(body);
}

}  // namespace

int run_job(int argc, char** argv, const JobDescription& job, const JobBody& body) {
  const Arguments arguments = parse_arguments(argc, argv, job);
  if (arguments.exit) return *arguments.exit;
  const Result<void> result = run_on(arguments.directory, job, body);
  if (!result) log::error("opaline-{}: {}", job.name, result.error().message);
  return status_of(result);
}

}  // namespace opaline::daemon
