#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "base/events.h"
#include "base/frame.h"
#include "base/result.h"
#include "capture/frame_check.h"
#include "capture/station.h"

namespace opaline::calibration {

/// Code of the whole projector picture, red, green, blue.
using FlatLight = std::array<std::uint8_t, 3>;
inline constexpr FlatLight kWhite{255, 255, 255};

/// Takes frames of flat lights and of the dark, each checked to show what was asked for and taken again up to three times.
/// Every frame has a pattern id of its own, and every dark one an exposure some microseconds longer than the last, so that
/// none can pass for another.
///
/// Threads: one caller at a time. Waits as the devices do. Errors: kUnavailable or kTimeout, saying which frame, once the
/// retries are used up; kCancelled; kInvalidArgument for an exposure that the camera cannot take.
class FrameTaker {
 public:
  /// Opens the devices. `events` outlives us.
  static Result<std::unique_ptr<FrameTaker>> create(const capture::Station& station,
                                                    EventSink& events);
  /// Leaves the lamp dark.
  ~FrameTaker();
  FrameTaker(const FrameTaker&) = delete;
  FrameTaker& operator=(const FrameTaker&) = delete;

  /// `turns` of the colour wheel under a light; shows and settles first.
  Result<Frame> lit(const FlatLight& light, int turns, std::stop_token stop);
  /// `turns` of the colour wheel under a picture of grey codes, one channel, of the projector's size.
  Result<Frame> pictured(const Image<std::uint8_t>& grey,
                         const std::string& name,
                         int turns,
                         std::stop_token stop);
  /// Switches the lamp off for a time, which tells whoever attends the station to do what is next.
  Result<void> rest(std::chrono::nanoseconds time, std::stop_token stop);
  /// Lamp off.
  Result<Frame> dark(std::chrono::nanoseconds exposure, std::stop_token stop);
  /// Waits on the station's clock.
  Result<void> pause(std::chrono::nanoseconds time, std::stop_token stop) const;

  /// `watcher` is called with every frame that was accepted, before it is returned.
  void show_frames_to(std::function<void(const Frame&)> watcher) { watcher_ = std::move(watcher); }

  const drivers::CameraInfo& camera() const { return camera_; }
  const drivers::ProjectorInfo& projector() const { return projector_; }
  std::chrono::nanoseconds now() const { return station_.clock.now(); }
  double pace() const { return station_.clock.pace(); }
  /// The fewest and most whole turns that the camera can expose; `least` is 1 or more.
  int least_turns() const;
  int most_turns() const;

 private:
  FrameTaker(const capture::Station& station, EventSink& events)
      : station_(station), events_(events) {}
  Result<void> open();
  Result<Frame> retried(const std::string& name,
                        const std::function<Result<Frame>()>& attempt,
                        const std::stop_token& stop);
  Result<Frame> attempt_lit(const Image<std::uint8_t>& codes,
                            const std::string& name,
                            std::chrono::nanoseconds exposure,
                            const std::stop_token& stop);
  Result<Frame> attempt_dark(std::chrono::nanoseconds exposure, const std::stop_token& stop);
  Result<Frame> checked(std::uint64_t pattern,
                        std::string name,
                        std::chrono::nanoseconds exposure,
                        const std::stop_token& stop);
  std::chrono::nanoseconds turn() const;

  capture::Station station_;
  EventSink& events_;
  drivers::CameraInfo camera_;
  drivers::ProjectorInfo projector_;
  std::optional<capture::FrameCheck> check_;
  std::uint64_t next_pattern_ = 1000;
  std::int64_t dark_frames_ = 0;
  std::function<void(const Frame&)> watcher_;
};

}  // namespace opaline::calibration
