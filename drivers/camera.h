#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>
#include <string>

#include "base/frame.h"
#include "base/result.h"

namespace opaline::drivers {

struct CameraInfo {
  std::string model;
  std::string serial;
  int width = 0;
  int height = 0;
  int bit_depth = 12;
  std::chrono::nanoseconds shortest_exposure{};
  std::chrono::nanoseconds longest_exposure{};
};

struct ExposureRequest {
  std::chrono::nanoseconds exposure{};
  /// What the projector was told; only replay needs it, to pick the photograph.
  std::uint64_t expected_pattern = 0;
  std::string expected_name = {};
};

/// A camera that takes one exposure when asked.
///
///     closed --open()--> idle --capture()--> exposing --> idle
///        ^                 |                    |
///        +----close()------+         device lost: closed, kUnavailable
///
/// Threads: one caller at a time; close() may come from any thread and ends a capture with kCancelled.
/// Waits:   open() at most 5 s; capture() at most 1.5 times the exposure plus 2 s, then kTimeout;
///          a stop request ends it with kCancelled within 100 ms.
/// Errors:  kInvalidArgument for an exposure out of range; kUnavailable while closed, or when the device is lost or
///          taken by somebody else (open() again once it is back); kNotFound where no such device exists.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual Result<void> open() = 0;
  virtual Result<CameraInfo> info() const = 0;
  /// Takes one exposure. The frame's own fields say what it is: the caller checks them against what
  /// it asked for.
  virtual Result<Frame> capture(const ExposureRequest& request, std::stop_token stop) = 0;
  virtual void close() noexcept = 0;
};

}  // namespace opaline::drivers
