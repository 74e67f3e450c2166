#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "base/clock.h"
#include "base/files.h"
#include "base/session_directory.h"
#include "daemon/event_follower.h"
#include "daemon/executor.h"
#include "daemon/job_stopper.h"
#include "daemon/session_snapshot.h"

namespace opaline::daemon {

/// Locks of stations that jobs started here are about to take, so that two sessions do not race.
using BusyStations = std::set<std::filesystem::path>;

/// Takes one session through its stages: looks at its log and its lock, and starts what is next.
///
///   queued -> waiting for station -> running (stage by stage) -> succeeded | failed | cancelled
///
/// Everything it must remember is in the session's directory, so another supervisor goes on where this one was
/// dropped; jobs outlive it. Once a cancel is wished (daemon/cancel_wish.h) the job is made to stop,
/// and no other is started. A stage that dies is started again, at most kFruitlessRuns times in a
/// row without a fact logged; one that fails is not.
/// Threads: one at a time.
class SessionSupervisor {
 public:
  struct Neighbours {
    Executor& executor;
    FileOperations& files;
    const Clock& clock;
  };

  /// `station_lock` is empty when the session needs no station.
  SessionSupervisor(SessionDirectory session,
                    std::filesystem::path station_lock,
                    Neighbours neighbours,
                    const JobStopper::Options& stopping = {})
      : session_(std::move(session)),
        station_lock_(std::move(station_lock)),
        neighbours_(neighbours),
        follower_(session_.events()),
        stopper_(stopping, neighbours_.clock) {}

  /// Looks once, does what is due, and says how things are. To be called a few times a second.
  /// Errors: the log cannot be read, or a decision cannot be logged; later calls try again.
  Result<SessionSnapshot> step(BusyStations& stations);
  /// What failed or was cancelled is tried again, and a wish to cancel forgotten. kBusy while a job works on the session.
  Result<void> resume();

  const SessionDirectory& session() const { return session_; }

 private:
  Result<Decision> look();
  Result<Decision> decide_now(bool alive);
  Result<void> act(const Decision& decision, BusyStations& stations);
  Result<void> start(std::size_t stage);
  void note_exit(int exit);
  void make_job_stop();
  std::string station_obstacle(std::size_t stage, const BusyStations& stations) const;
  Result<void> log_under_lock(std::string_view type,
                              const nlohmann::json& data,
                              const std::function<Result<bool>(const Decision&)>& still_due);

  SessionDirectory session_;
  std::filesystem::path station_lock_;
  Neighbours neighbours_;  // outlive us
  EventFollower follower_;
  JobStopper stopper_;
  SessionHistory history_;
  std::unique_ptr<JobProcess> child_;
  std::optional<std::size_t> child_stage_;
  std::uint64_t seq_at_start_ = 0;
  std::string start_failure_;  // why the stage cannot be started at all
  std::optional<std::chrono::nanoseconds> retry_after_;
  std::string waits_for_;  // why the stage cannot be started yet
};

}  // namespace opaline::daemon
