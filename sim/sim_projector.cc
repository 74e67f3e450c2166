#include "sim/sim_projector.h"

#include <utility>

namespace opaline::sim {

Result<void> SimProjector::open() {
  close_session();
  const auto opened = rig_.open_projector();
  if (!opened) return opened.error();
  const std::lock_guard lock(mutex_);
  session_ = opened->session;
  info_ = opened->info;
  return ok();
}

Result<drivers::ProjectorInfo> SimProjector::info() const {
  const std::lock_guard lock(mutex_);
  if (session_ == 0) return unavailable("simulated projector: not open");
  return info_;
}

Result<void> SimProjector::show(const drivers::Pattern& pattern, std::stop_token stop) {
  const std::uint64_t opened = session();
  if (opened == 0) return unavailable("simulated projector: not open");
  Result<void> shown = rig_.show(opened, pattern, stop);
  if (!shown && shown.error().code == ErrorCode::kUnavailable) {
    const std::lock_guard lock(mutex_);
    if (session_ == opened) session_ = 0;
  }
  return shown;
}

void SimProjector::close_session() noexcept {
  std::uint64_t session = 0;
  {
    const std::lock_guard lock(mutex_);
    session = std::exchange(session_, 0);
  }
  if (session != 0) rig_.close_projector(session);
}

}  // namespace opaline::sim
