#include "drivers/replay/replay_projector.h"

#include <fmt/format.h>

#include <utility>

namespace opaline::drivers {

Result<void> ReplayProjector::open() {
  auto index = read_replay_index(folder_);
  if (!index) return index.error();
  const std::lock_guard lock(mutex_);
  index_ = *std::move(index);
  return ok();
}

Result<ProjectorInfo> ReplayProjector::info() const {
  const std::lock_guard lock(mutex_);
  if (!index_) return unavailable("replay projector: not open");
  return ProjectorInfo{"no projector",
                       folder_.string(),
                       index_->projector_width,
                       index_->projector_height,
                       index_->frame_period,
                       index_->latency};
}

Result<void> ReplayProjector::show(const Pattern& pattern, std::stop_token stop) {
  const std::lock_guard lock(mutex_);
  if (!index_) return unavailable("replay projector: not open");
  if (stop.stop_requested()) return cancelled("replay projector: stopped");
  const auto& codes = pattern.codes;
  const bool fits = codes.width() == index_->projector_width &&
                    codes.height() == index_->projector_height && codes.channels() == 3;
  if (pattern.id != 0 && fits) return ok();
  return invalid_argument(
      fmt::format("pattern {} of {} x {} x {}; expected an id > 0 and {} x {} x 3",
                  pattern.id,
                  codes.width(),
                  codes.height(),
                  codes.channels(),
                  index_->projector_width,
                  index_->projector_height));
}

void ReplayProjector::close() noexcept {
  const std::lock_guard lock(mutex_);
  index_.reset();
}

}  // namespace opaline::drivers
