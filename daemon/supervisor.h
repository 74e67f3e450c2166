#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/session_supervisor.h"

namespace opaline::daemon {

/// Takes many sessions through their stages, oldest first where they want the same station, on a
/// thread of its own. Destroying it leaves the jobs running. Thread-safe.
class Supervisor {
 public:
  struct Hooks {
    /// The lock of the station that a session uses; empty when it uses none.
    std::function<std::filesystem::path(const SessionDirectory&)> station_lock;
    /// Called on the supervisor's thread when a session's state or stage has changed.
    std::function<void(const SessionSnapshot&)> changed;
  };
  struct Options {
    std::chrono::milliseconds period{100};  ///< between two looks at every session
    JobStopper::Options stopping;           ///< of jobs whose session is cancelled
  };

  Supervisor(SessionSupervisor::Neighbours neighbours, Hooks hooks, const Options& options);
  Supervisor(SessionSupervisor::Neighbours neighbours, Hooks hooks)
      : Supervisor(neighbours, std::move(hooks), Options()) {}

  /// Takes care of a session until it is over, and looks at it at once; adding it twice is fine.
  void add(SessionDirectory session);
  /// The newest snapshot of a session that is being taken care of.
  std::optional<SessionSnapshot> snapshot(const std::string& id) const;
  /// The newest of each session that is being taken care of, oldest session first; one that was just
  /// added is said to be queued.
  std::vector<SessionSnapshot> snapshots() const;

 private:
  struct Entry {
    SessionSupervisor supervisor;
    std::string last_error;
    bool added_again = false;  // guarded by mutex_; since it was last looked at
  };

  void run(const std::stop_token& stop);
  void step_all();
  std::vector<Entry*> entries();
  bool step_one(Entry& entry, BusyStations& stations);  // false when the session is over
  void publish(const SessionSnapshot& snapshot);

  SessionSupervisor::Neighbours neighbours_;
  Hooks hooks_;
  Options options_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool woken_ = false;  // guarded by mutex_
  // guarded by mutex_, which no step holds: one may wait for a job. Only thread_ takes entries out
  // or uses them. Ids begin with the time.
  std::map<std::string, Entry> active_;
  mutable std::mutex snapshots_mutex_;
  std::map<std::string, SessionSnapshot> snapshots_;  // guarded by snapshots_mutex_
  std::jthread thread_;                               // last: joins first
};

}  // namespace opaline::daemon
