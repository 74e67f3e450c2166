#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>
#include <string>

#include "base/image.h"
#include "base/result.h"

namespace opaline::drivers {

struct ProjectorInfo {
  std::string model;
  std::string serial;
  int width = 0;
  int height = 0;
  std::chrono::nanoseconds
      frame_period{};                  ///< of the colour wheel: exposures are whole multiples of it
  std::chrono::nanoseconds latency{};  ///< from show() to light, at most
};

/// What is to be shown. Codes are 8-bit, 3 channels, what the video input takes: gamma is the
/// caller's to undo.
struct Pattern {
  std::uint64_t id = 0;  ///< > 0, unique within a session
  Image<std::uint8_t> codes;
  std::string name = {};  ///< "region_0_1"; for people and for replay
};

/// A projector that shows one pattern until told otherwise.
///
///     closed --open()--> dark --show()--> showing --show()--> showing
///        ^                ^ |                |
///        +----close()-----+-+----dark()------+         device lost: closed, kUnavailable
///
/// open() and close() leave the lamp dark. show() returns once the pattern is *commanded*; light
/// follows within the latency, so a caller settles before it exposes.
///
/// Threads: one caller at a time; dark() may come from any thread, and a show() that it overtakes lights nothing.
/// Waits:   every call at most 2 s, then kTimeout; a stop request ends it with kCancelled within 100 ms.
/// Errors:  kInvalidArgument for a pattern of the wrong size or id 0; kUnavailable while closed, when lost, or when made
///          dark by somebody else; kCancelled for a show() that dark() overtook.
class Projector {
 public:
  virtual ~Projector() = default;
  virtual Result<void> open() = 0;
  virtual Result<ProjectorInfo> info() const = 0;
  virtual Result<void> show(const Pattern& pattern, std::stop_token stop) = 0;
  /// Light off, safe for people; works whenever the device can be reached.
  virtual Result<void> dark() = 0;
  virtual void close() noexcept = 0;
};

}  // namespace opaline::drivers
