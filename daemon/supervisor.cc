#include "daemon/supervisor.h"

#include <utility>

#include "base/log.h"

namespace opaline::daemon {

Supervisor::Supervisor(SessionSupervisor::Neighbours neighbours,
                       Hooks hooks,
                       const Options& options)
    : neighbours_(neighbours),
      hooks_(std::move(hooks)),
      options_(options),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void Supervisor::add(SessionDirectory session) {
  const std::filesystem::path lock = hooks_.station_lock(session);
  const std::string id = session.id();
  const std::lock_guard guard(mutex_);
  active_.try_emplace(id, Entry{SessionSupervisor(std::move(session), lock, neighbours_), {}});
  woken_ = true;
  wake_.notify_all();
}

std::optional<SessionSnapshot> Supervisor::snapshot(const std::string& id) const {
  const std::lock_guard guard(snapshots_mutex_);
  const auto it = snapshots_.find(id);
  return it == snapshots_.end() ? std::nullopt : std::optional(it->second);
}

void Supervisor::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    step_all();
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, options_.period, [this] { return std::exchange(woken_, false); });
  }
}

void Supervisor::step_all() {
  const std::lock_guard guard(mutex_);
  BusyStations stations;
  for (auto it = active_.begin(); it != active_.end();) {
    it = step_one(it->second, stations) ? std::next(it) : active_.erase(it);
  }
}

bool Supervisor::step_one(Entry& entry, BusyStations& stations) {
  const Result<SessionSnapshot> snapshot = entry.supervisor.step(stations);
  if (!snapshot) {
    if (entry.last_error != snapshot.error().message) {
      log::warning("session {}: {}", entry.supervisor.session().id(), snapshot.error().message);
      entry.last_error = snapshot.error().message;
    }
    return true;
  }
  entry.last_error.clear();
  publish(*snapshot);
  return !is_over(snapshot->state);
}

void Supervisor::publish(const SessionSnapshot& snapshot) {
  bool changed = true;
  {
    const std::lock_guard guard(snapshots_mutex_);
    const auto it = snapshots_.find(snapshot.id);
    if (it != snapshots_.end()) {
      changed = it->second.state != snapshot.state || it->second.stage != snapshot.stage;
    }
    if (is_over(snapshot.state)) {
      snapshots_.erase(snapshot.id);
    } else {
      snapshots_[snapshot.id] = snapshot;
    }
  }
  if (changed) hooks_.changed(snapshot);
}

}  // namespace opaline::daemon
