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
  {
    const std::lock_guard guard(snapshots_mutex_);
    const SessionHistory nothing;
    snapshots_.try_emplace(id, make_snapshot(session, nothing, decide(nothing, false, false)));
  }
  const std::lock_guard guard(mutex_);
  const auto [it, is_new] = active_.try_emplace(
      id, Entry{SessionSupervisor(std::move(session), lock, neighbours_, options_.stopping), {}});
  it->second.added_again = !is_new;
  woken_ = true;
  wake_.notify_all();
}

std::optional<SessionSnapshot> Supervisor::snapshot(const std::string& id) const {
  const std::lock_guard guard(snapshots_mutex_);
  const auto it = snapshots_.find(id);
  return it == snapshots_.end() ? std::nullopt : std::optional(it->second);
}

std::vector<SessionSnapshot> Supervisor::snapshots() const {
  const std::lock_guard guard(snapshots_mutex_);
  std::vector<SessionSnapshot> all;
  for (const auto& [id, snapshot] : snapshots_) all.push_back(snapshot);
  return all;
}

void Supervisor::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    step_all();
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, options_.period, [this] { return std::exchange(woken_, false); });
  }
}

std::vector<Supervisor::Entry*> Supervisor::entries() {
  const std::lock_guard guard(mutex_);
  std::vector<Entry*> result;
  for (auto& [id, entry] : active_) {
    entry.added_again = false;
    result.push_back(&entry);
  }
  return result;
}

// One that was over and is added again at that moment has perhaps been resumed: it stays.
void Supervisor::step_all() {
  BusyStations stations;
  for (Entry* entry : entries()) {
    if (step_one(*entry, stations)) continue;
    const std::lock_guard guard(mutex_);
    if (!entry->added_again) active_.erase(entry->supervisor.session().id());
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
