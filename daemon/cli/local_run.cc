#include <atomic>
#include <csignal>
#include <stop_token>

#include "daemon/cancel_wish.h"
#include "daemon/cli/run.h"
#include "daemon/cli/terminal.h"
#include "daemon/event_follower.h"
#include "daemon/executor.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/session_supervisor.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::milliseconds kPeriod{100};

void show_new(EventFollower& log, ProgressView& view) {
  const auto events = log.poll();
  if (!events) return;  // the supervisor says so
  for (const Event& event : *events) view.on_event(event.type, event.data);
}

/// Tells each new trouble once.
class Troubles {
 public:
  explicit Troubles(ProgressView& view) : view_(view) {}
  void tell(const Error& error) {
    if (error.message != told_) view_.say(error.message + "; trying again");
    told_ = error.message;
  }
  void over() { told_.clear(); }

 private:
  ProgressView& view_;
  std::string told_;
};

}  // namespace

Result<Ending> run_locally(const SessionDirectory& session,
                           const std::filesystem::path& programs,
                           const std::filesystem::path& station_lock) {
  LocalExecutor executor(programs);
  const SystemClock clock;
  ProgressView view(terminal_options(), clock);
  Troubles troubles(view);
  EventFollower log(session.events());
  if (auto earlier = log.poll(); !earlier) return earlier.error();  // of runs before this one
  SessionSupervisor supervisor(session, station_lock, {executor, system_files(), clock});
  std::atomic<bool> cancel = false;
  std::stop_source leave;
  auto signals = StopSignals::watch([&](int signal) {
    if (signal == SIGTERM || cancel.exchange(true)) leave.request_stop();
  });
  if (!signals) return signals.error();
  SessionState told = SessionState::kQueued;
  bool wished = false;
  for (SystemClock pause;; pause.sleep(kPeriod, leave.get_token())) {
    if (cancel && !wished) {
      const auto wish = wish_cancel(system_files(), session);
      if (!wish) return wish.error();
      wished = true;
    }
    BusyStations stations;
    const Result<SessionSnapshot> snapshot = supervisor.step(stations);
    if (!snapshot && leave.stop_requested()) return snapshot.error();
    if (!snapshot) {
      troubles.tell(snapshot.error());
      continue;
    }
    troubles.over();
    show_new(log, view);
    if (snapshot->state != told) view.on_state(to_json(*snapshot));
    told = snapshot->state;
    if (is_over(told) || leave.stop_requested()) {
      return Ending{snapshot->id, session.path(), std::string(to_string(told)), snapshot->message};
    }
  }
}

Result<void> resume_locally(const SessionDirectory& session) {
  const Result<SessionSnapshot> snapshot = read_snapshot(session);
  if (!snapshot) return snapshot.error();
  if (snapshot->state != SessionState::kFailed && snapshot->state != SessionState::kCancelled) {
    return ok();
  }
  LocalExecutor nobody({});
  const SystemClock clock;
  return SessionSupervisor(session, {}, {nobody, system_files(), clock}).resume();
}

}  // namespace opaline::daemon
