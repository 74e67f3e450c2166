#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>

#include "base/clock.h"
#include "drivers/camera.h"
#include "drivers/replay/replay_index.h"

namespace opaline::drivers {

/// A folder of photographs as a camera: an exposure is the photograph of the expected pattern whose exposure is
/// nearest (in ratio) to the one asked for; the frame says what the photograph's was. Exposures range from 0.9 times
/// the shortest to 1.1 times the longest photograph's. A capture takes as long as reading the file does; it looks at
/// the stop token, and whether it was closed, before each step of that.
///
/// Errors, besides Camera's: kNotFound without a photograph of the pattern; kUnavailable, naming the file, for one that
/// is gone, damaged, or not as the index says.
class ReplayCamera : public Camera {
 public:
  /// The clock dates the frames; it must outlive the camera.
  ReplayCamera(std::filesystem::path folder, const Clock& clock)
      : folder_(std::move(folder)), clock_(clock) {}

  Result<void> open() override;
  Result<CameraInfo> info() const override;
  Result<Frame> capture(const ExposureRequest& request, std::stop_token stop) override;
  void close() noexcept override;

 private:
  using Index = std::shared_ptr<const ReplayIndex>;
  bool is_open_with(const Index& index) const;
  Result<Frame> read_frame(const Index& index,
                           const ExposureRequest& request,
                           const std::stop_token& stop) const;

  std::filesystem::path folder_;
  const Clock& clock_;
  mutable std::mutex mutex_;
  Index index_;                      // guarded by mutex_; of this opening; null: closed
  std::uint64_t trigger_count_ = 0;  // guarded by mutex_
};

}  // namespace opaline::drivers
