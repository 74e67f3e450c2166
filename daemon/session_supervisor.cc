#include "daemon/session_supervisor.h"

#include <fmt/format.h>

#include "base/event_log.h"
#include "base/lock.h"
#include "base/log.h"
#include "daemon/cancel_wish.h"
#include "daemon/jobs/program.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::seconds kRetryBusyAfter{1};
constexpr int kExitBusy = status_of(ProgramExit::kBusy);

}  // namespace

// The lock is looked at before the log: a job that ends in between is then seen to have finished.
Result<Decision> SessionSupervisor::look() {
  if (child_ != nullptr) {
    if (const std::optional<int> exit = child_->poll_exit()) note_exit(*exit);
  }
  const Result<bool> held = FileLock::is_held(session_.lock());
  if (!held) return held.error();
  return decide_now(*held || child_ != nullptr);
}

// What the directory says, and what we know beside it: a program that does not start.
Result<Decision> SessionSupervisor::decide_now(bool alive) {
  const Result<std::vector<Event>> events = follower_.poll();
  if (!events) return events.error();
  for (const Event& event : *events) history_.apply(event);
  Decision decision = decide(history_, alive, is_cancel_wished(session_));
  if (decision.action == Action::kStart && !start_failure_.empty()) {
    decision.action = Action::kGiveUp;
  }
  return decision;
}

Result<SessionSnapshot> SessionSupervisor::step(BusyStations& stations) {
  Result<Decision> decision = look();
  if (!decision) return decision.error();
  waits_for_.clear();
  if (auto acted = act(*decision, stations); !acted) return acted.error();
  if (child_ != nullptr && kStages[*child_stage_] == kStationStage) stations.insert(station_lock_);
  if (decision->action == Action::kGiveUp || decision->action == Action::kCloseCancel) {
    if (decision = look(); !decision) return decision.error();
  }
  if (decision->state != SessionState::kCancelling) stopper_.reset();
  SessionSnapshot snapshot = make_snapshot(session_, history_, *decision);
  if (decision->action == Action::kStart && child_ != nullptr) {
    snapshot.state = SessionState::kRunning;
  }
  if (!waits_for_.empty()) {
    snapshot.state = SessionState::kWaiting;
    snapshot.message = waits_for_;
  }
  return snapshot;
}

Result<void> SessionSupervisor::act(const Decision& decision, BusyStations& stations) {
  switch (decision.action) {
    case Action::kNone:
      if (decision.state == SessionState::kCancelling) make_job_stop();
      return ok();
    case Action::kStart:
      waits_for_ = station_obstacle(decision.stage, stations);
      return waits_for_.empty() ? start(decision.stage) : ok();
    case Action::kGiveUp: {
      const std::string message =
          !start_failure_.empty()
              ? start_failure_
              : fmt::format(
                    "opaline-{} died {} times in a row without getting anywhere; see job.log",
                    kStages[decision.stage],
                    history_.stages()[decision.stage].fruitless);
      return log_under_lock("job.finished",
                            {{"job", kStages[decision.stage]},
                             {"outcome", "failed"},
                             {"code", to_string(ErrorCode::kInternal)},
                             {"message", message}},
                            [](const Decision& d) { return d.action == Action::kGiveUp; });
    }
    case Action::kCloseCancel:
      return log_under_lock("session.cancelled", nlohmann::json::object(), [](const Decision& d) {
        return d.action == Action::kCloseCancel;
      });
  }
  return ok();
}

// Empty when the stage can have its station.
std::string SessionSupervisor::station_obstacle(std::size_t stage,
                                                const BusyStations& stations) const {
  static constexpr const char* kInUse =
      "the station is in use by another session, a calibration or a viewfinder";
  if (kStages[stage] != kStationStage || station_lock_.empty()) return {};
  if (retry_after_ && neighbours_.clock.now() < *retry_after_) return kInUse;
  const Result<bool> held = FileLock::is_held(station_lock_);
  if (!held) return held.error().message;
  return *held || stations.contains(station_lock_) ? kInUse : "";
}

Result<void> SessionSupervisor::start(std::size_t stage) {
  seq_at_start_ = history_.last_seq();
  auto started = neighbours_.executor.start({std::string(kStages[stage]), session_.path()});
  if (!started) {
    start_failure_ = started.error().message;
    return ok();  // given up, in the log, at the next step
  }
  log::info("session {}: opaline-{} started", session_.id(), kStages[stage]);
  child_ = *std::move(started);
  child_stage_ = stage;
  return ok();
}

// A program that ends without a word in the log could not even begin; kExitBusy is another job's
// doing, and the log of that one says more.
void SessionSupervisor::note_exit(int exit) {
  child_.reset();
  log::info("session {}: opaline-{} ended with {}", session_.id(), kStages[*child_stage_], exit);
  if (const auto events = follower_.poll()) {
    for (const Event& event : *events) history_.apply(event);
  }
  if (history_.stages()[*child_stage_].state == StageState::kBusy) {
    retry_after_ = neighbours_.clock.now() + kRetryBusyAfter;
  } else if (history_.last_seq() == seq_at_start_ && exit != kExitBusy) {
    start_failure_ = fmt::format("opaline-{} ended with status {} before it began; see {}",
                                 kStages[*child_stage_],
                                 exit,
                                 (session_.path() / "job.log").string());
  }
}

void SessionSupervisor::make_job_stop() {
  const auto child = child_ != nullptr ? child_->pid() : std::nullopt;
  stopper_.step(session_, child, history_.cancel_requested());
}

Result<void> SessionSupervisor::resume() {
  start_failure_.clear();
  const auto is_due = [this](const Decision& decision) -> Result<bool> {
    if (decision.state != SessionState::kFailed && decision.state != SessionState::kCancelled) {
      return false;
    }
    auto forgotten = forget_cancel(neighbours_.files, session_);
    return forgotten ? Result<bool>(true) : forgotten.error();
  };
  return log_under_lock("session.resumed", nlohmann::json::object(), is_due);
}

// The log has one writer, the holder of the lock; under it the decision is made again.
Result<void> SessionSupervisor::log_under_lock(
    std::string_view type,
    const nlohmann::json& data,
    const std::function<Result<bool>(const Decision&)>& still_due) {
  const Result<FileLock> lock = FileLock::acquire(session_.lock());
  if (!lock) return lock.error();
  const Result<Decision> decision = decide_now(false);
  if (!decision) return decision.error();
  const Result<bool> due = still_due(*decision);
  if (!due) return due.error();
  if (!*due) return ok();
  const auto log = EventLog::open(neighbours_.files, session_.events());
  if (!log) return log.error();
  if (auto appended = (*log)->append(type, data); !appended) return appended.error();
  start_failure_.clear();
  return ok();
}

}  // namespace opaline::daemon
