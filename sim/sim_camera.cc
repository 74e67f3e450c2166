#include "sim/sim_camera.h"

#include <utility>

namespace opaline::sim {

Result<void> SimCamera::open() {
  close_session();
  const auto opened = rig_.open_camera();
  if (!opened) return opened.error();
  const std::lock_guard lock(mutex_);
  session_ = opened->session;
  info_ = opened->info;
  closing_ = std::stop_source();
  return ok();
}

Result<drivers::CameraInfo> SimCamera::info() const {
  const std::lock_guard lock(mutex_);
  if (session_ == 0) return unavailable("simulated camera: not open");
  return info_;
}

Result<Frame> SimCamera::capture(const drivers::ExposureRequest& request, std::stop_token stop) {
  std::uint64_t session = 0;
  std::stop_token closing;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
    closing = closing_.get_token();
  }
  if (session == 0) return unavailable("simulated camera: not open");
  std::stop_source either;
  const std::stop_callback on_stop(stop, [&] { either.request_stop(); });
  const std::stop_callback on_close(closing, [&] { either.request_stop(); });
  Result<Frame> frame = rig_.expose(session, request.exposure, either.get_token());
  if (!frame && frame.error().code == ErrorCode::kUnavailable) {
    const std::lock_guard lock(mutex_);
    if (session_ == session) session_ = 0;
  }
  return frame;
}

void SimCamera::close_session() noexcept {
  std::uint64_t session = 0;
  {
    const std::lock_guard lock(mutex_);
    session = std::exchange(session_, 0);
    closing_.request_stop();
  }
  if (session != 0) rig_.close_camera(session);
}

}  // namespace opaline::sim
