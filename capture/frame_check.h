#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/frame.h"
#include "drivers/camera.h"

namespace opaline::capture {

/// Why a frame proves nothing.
enum class FrameFault : std::uint8_t {
  kWrongSize,      ///< not the camera's size or depth
  kTorn,           ///< the pixels are not those the camera hashed
  kWrongPattern,   ///< shows another pattern than the one asked for, or more than one: stale
  kMissing,        ///< the camera exposed oftener, or less often, than it was asked to
  kOutOfOrder,     ///< did not begin after the frame before it
  kWrongExposure,  ///< exposed otherwise than asked
  kDuplicate,      ///< the same pixels as the frame before, though something else was asked for
  kBlack,          ///< no light where other exposures prove that there is some
};
std::string_view to_string(FrameFault fault);  ///< "torn", "wrong_pattern", as in the event log

struct FrameProblem {
  FrameFault fault;
  std::string message;
};

/// Checks each frame of one open camera against what was asked for and against the frame before:
/// hash of the pixels, pattern id, trigger count one up, time in order, exposure within 15 %,
/// content new.
class FrameCheck {
 public:
  explicit FrameCheck(drivers::CameraInfo camera) : camera_(std::move(camera)) {}
  /// None when the frame is what was asked for: it becomes the frame before the next. After a bad one
  /// it is not known where the camera's count stands.
  std::optional<FrameProblem> check(const Frame& frame,
                                    std::uint64_t pattern_id,
                                    std::chrono::nanoseconds exposure);
  /// After a capture that delivered nothing, or a camera opened anew: the next trigger count is not
  /// known.
  void forget();

 private:
  struct Before {
    std::optional<std::uint64_t> trigger_count;  ///< none when not known
    std::chrono::nanoseconds start;
    std::uint64_t pattern_id;
    std::chrono::nanoseconds exposure_asked;
    std::string sha256;
  };
  std::optional<FrameProblem> find(const Frame& frame,
                                   std::uint64_t pattern_id,
                                   std::chrono::nanoseconds exposure) const;
  std::optional<FrameProblem> against_before(const Frame& frame,
                                             std::uint64_t pattern_id,
                                             std::chrono::nanoseconds exposure) const;
  drivers::CameraInfo camera_;
  std::optional<Before> before_;
};

}  // namespace opaline::capture
