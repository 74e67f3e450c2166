#include "daemon/event_follower.h"

#include <system_error>

namespace opaline::daemon {

Result<std::vector<Event>> EventFollower::poll() {
  std::error_code missing;
  const std::uint64_t size = std::filesystem::file_size(log_, missing);
  if (missing) return std::vector<Event>{};
  // The time too: a torn tail may be cut off and written over to the same size.
  const auto time = std::filesystem::last_write_time(log_, missing);
  if (missing || (size == seen_size_ && time == seen_time_)) return std::vector<Event>{};
  Result<EventBatch> batch = read_events(log_, offset_);
  if (!batch) return batch.error();
  offset_ = batch->next_offset;
  seen_size_ = size;
  seen_time_ = time;
  return std::move(batch->events);
}

}  // namespace opaline::daemon
