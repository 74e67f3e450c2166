#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/event_log.h"
#include "base/result.h"

namespace opaline::daemon {

/// Reads a session's log as it grows, each event once.
class EventFollower {
 public:
  explicit EventFollower(std::filesystem::path log) : log_(std::move(log)) {}

  /// The events that came since the last call; cheap when there are none. Errors: as read_events.
  Result<std::vector<Event>> poll();

 private:
  std::filesystem::path log_;
  std::uint64_t offset_ = 0;
  std::uint64_t seen_size_ = 0;
  std::filesystem::file_time_type seen_time_;
};

}  // namespace opaline::daemon
