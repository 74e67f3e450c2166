#pragma once

#include <filesystem>

#include "sim/rig_message.h"
#include "sim/rig_port.h"

namespace opaline::sim {

/// A rig in another process, through its socket. Every call is a connection of its own, so there is nothing to keep
/// up: a rig that was started again is simply another rig, whose devices want opening.
///
/// Threads, waits, errors: as RigPort; an exposure's deadline is 1.5 times its length plus 2 s of real time.
class RigClient : public RigPort {
 public:
  explicit RigClient(std::filesystem::path socket) : socket_(std::move(socket)) {}

  Result<Opened<drivers::CameraInfo>> open_camera() override;
  Result<Opened<drivers::ProjectorInfo>> open_projector() override;
  Result<Frame> expose(std::uint64_t session,
                       std::chrono::nanoseconds exposure,
                       std::stop_token stop) override;
  Result<void> show(std::uint64_t session,
                    const drivers::Pattern& pattern,
                    std::stop_token stop) override;
  void close_camera(std::uint64_t session) noexcept override;
  void close_projector(std::uint64_t session) noexcept override;
  Result<void> dark(std::uint64_t session) override;
  Result<RigStatus> status() override;
  Result<RigTruth> truth() override;
  Result<void> arm(const Faults& faults) override;
  Result<void> add(const Faults& faults) override;
  /// Asks the rig to darken its lamp and end; it does so within a second.
  Result<void> end();

 private:
  Result<RigMessage> ask(const char* what,
                         RigMessage request = {},
                         std::chrono::nanoseconds patience = std::chrono::seconds(2),
                         std::stop_token stop = {}) const;
  void close(const char* what, std::uint64_t session) const noexcept;

  std::filesystem::path socket_;
};

}  // namespace opaline::sim
