#include "capture/frame_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/seconds.h"

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;

constexpr double kExposureTolerance = 0.15;  // nominal 1/8 s for four thirtieths, as cameras round

bool uniform(const Image<std::uint16_t>& pixels) {
  const auto samples = pixels.samples();
  return std::ranges::all_of(samples, [&](std::uint16_t s) { return s == samples.front(); });
}

FrameProblem problem(FrameFault fault, std::string message) { return {fault, std::move(message)}; }

}  // namespace

std::string_view to_string(FrameFault fault) {
  switch (fault) {
    case FrameFault::kWrongSize:
      return "wrong_size";
    case FrameFault::kTorn:
      return "torn";
    case FrameFault::kWrongPattern:
      return "wrong_pattern";
    case FrameFault::kMissing:
      return "missing";
    case FrameFault::kOutOfOrder:
      return "out_of_order";
    case FrameFault::kWrongExposure:
      return "wrong_exposure";
    case FrameFault::kDuplicate:
      return "duplicate";
    case FrameFault::kBlack:
      return "black";
  }
  return "unknown";
}

std::optional<FrameProblem> FrameCheck::check(const Frame& frame,
                                              std::uint64_t pattern_id,
                                              nanoseconds exposure) {
  auto found = find(frame, pattern_id, exposure);
  if (found && before_) {
    before_->trigger_count.reset();
  } else if (!found) {
    before_ = Before{frame.trigger_count, frame.start, pattern_id, exposure, frame.sha256};
  }
  return found;
}

void FrameCheck::forget() { before_.reset(); }

std::optional<FrameProblem> FrameCheck::find(const Frame& frame,
                                             std::uint64_t pattern_id,
                                             nanoseconds exposure) const {
  const auto& pixels = frame.pixels;
  if (pixels.width() != camera_.width || pixels.height() != camera_.height ||
      pixels.channels() != 3 || frame.bit_depth != camera_.bit_depth) {
    return problem(FrameFault::kWrongSize,
                   fmt::format("{} x {} pixels of {} bits from a camera of {} x {} and {} bits",
                               pixels.width(),
                               pixels.height(),
                               frame.bit_depth,
                               camera_.width,
                               camera_.height,
                               camera_.bit_depth));
  }
  if (frame_hash(pixels) != frame.sha256) {
    return problem(FrameFault::kTorn, "its pixels are not those the camera hashed");
  }
  if (auto found = against_before(frame, pattern_id, exposure)) return found;
  if (frame.pattern_id != pattern_id) {
    return problem(FrameFault::kWrongPattern,
                   fmt::format("it shows pattern {}, asked for {}", frame.pattern_id, pattern_id));
  }
  if (std::abs(seconds(frame.exposure) / seconds(exposure) - 1.0) > kExposureTolerance) {
    return problem(
        FrameFault::kWrongExposure,
        fmt::format(
            "exposed {:.4f} s, asked for {:.4f}", seconds(frame.exposure), seconds(exposure)));
  }
  return std::nullopt;
}

std::optional<FrameProblem> FrameCheck::against_before(const Frame& frame,
                                                       std::uint64_t pattern_id,
                                                       nanoseconds exposure) const {
  if (!before_) return std::nullopt;
  const bool same_request =
      before_->pattern_id == pattern_id && before_->exposure_asked == exposure;
  // A picture of one value throughout (all clipped) may well repeat.
  if (!same_request && frame.sha256 == before_->sha256 && !uniform(frame.pixels)) {
    return problem(FrameFault::kDuplicate, "the same pixels as the frame before");
  }
  if (before_->trigger_count && frame.trigger_count != *before_->trigger_count + 1) {
    return problem(
        FrameFault::kMissing,
        fmt::format("trigger count {} after {}", frame.trigger_count, *before_->trigger_count));
  }
  if (frame.start <= before_->start) {
    return problem(FrameFault::kOutOfOrder,
                   fmt::format("began {:.4f} s before the frame before it",
                               seconds(before_->start - frame.start)));
  }
  return std::nullopt;
}

}  // namespace opaline::capture
