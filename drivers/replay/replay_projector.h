#pragma once

#include <filesystem>
#include <mutex>
#include <optional>

#include "drivers/projector.h"
#include "drivers/replay/replay_index.h"

namespace opaline::drivers {

/// The projector beside a ReplayCamera: takes patterns of the size that the index names, and shows nothing.
class ReplayProjector : public Projector {
 public:
  explicit ReplayProjector(std::filesystem::path folder) : folder_(std::move(folder)) {}

  Result<void> open() override;
  Result<ProjectorInfo> info() const override;
  Result<void> show(const Pattern& pattern, std::stop_token stop) override;
  Result<void> dark() override { return ok(); }
  void close() noexcept override;

 private:
  std::filesystem::path folder_;
  mutable std::mutex mutex_;
  std::optional<ReplayIndex> index_;  // guarded by mutex_; none: closed
};

}  // namespace opaline::drivers
