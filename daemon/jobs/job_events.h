#pragma once

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/clock.h"
#include "base/event_log.h"
#include "base/events.h"

namespace opaline::daemon {

/// A progress event's data: {"step","fraction","seconds_left"?,"detail"?}.
nlohmann::json to_json(const Progress& progress);

/// A job's events in its session's log: facts are on disk when fact() returns; of the progress at
/// most one entry in 200 ms is written, and each new step's first. Thread-safe.
class JobEvents : public EventSink {
 public:
  JobEvents(EventLog& log, const Clock& clock) : log_(log), clock_(clock) {}
  void progress(const Progress& progress) override;
  Result<void> fact(std::string_view type, const nlohmann::json& data) override;
  /// The newest progress, written or not; null before the first.
  nlohmann::json latest_progress() const;

 private:
  bool is_due(const Progress& progress);

  EventLog& log_;       // outlives us
  const Clock& clock_;  // outlives us
  mutable std::mutex mutex_;
  nlohmann::json latest_;                               // guarded by mutex_
  std::string written_step_;                            // guarded by mutex_
  std::optional<std::chrono::nanoseconds> written_at_;  // guarded by mutex_
};

}  // namespace opaline::daemon
