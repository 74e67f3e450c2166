#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/events.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/black_frames.h"
#include "capture/calibration.h"
#include "capture/capture_options.h"
#include "capture/exposure_chooser.h"
#include "capture/exposure_plan.h"
#include "capture/frame_check.h"
#include "capture/frame_store.h"
#include "capture/hdr_merge.h"
#include "capture/station.h"
#include "capture/steadiness.h"

namespace opaline::capture {

/// The frames of one light, and whether any shows light at all.
struct TakenLight {
  std::vector<CapturedFrame> frames;
  bool lit = false;
  int retaken = 0;  ///< how often frames were bad and the light was taken again
  /// What changed among its exposures the last time, when retries are used up: not to be measured by.
  std::optional<UnsteadyLight> unsteady = std::nullopt;
};

/// Takes one light after another: shows it, lets it settle, exposes, checks every frame. A light
/// with a bad frame, or whose exposures do not agree with each other (SteadinessCheck), is taken again from its first exposure, up to the
/// retries allowed; each time is a fact, "region.retaken" {region, attempt, fault, message}, and the latter also "region.unsteady" {region, attempt, kind, size,
/// deviation, shift_px or x and y, message}. Where it has moved for good, by the first exposures of an unsteady and a steady take, lights before do not go
/// with those to come: "sample.moved" {region, size, shift_px, message}, and kUnavailable. Exposures that disagree the same way each time are a "calibration.warning" {message}. Devices that were lost are closed
/// and opened again between the tries, until they are back or ten seconds are over; a camera that
/// is not the calibrated one ends it with kInvalidArgument.
///
/// Threads: one caller at a time. Waits as the devices do. Errors: kUnavailable or kTimeout, naming
/// light and exposure, when the retries are used up; kCancelled; kInvalidArgument.
class RegionTaker {
 public:
  struct Settings {
    CaptureOptions options;
    CameraCalibration camera;
  };
  /// Opens the devices. `events` outlives us.
  static Result<std::unique_ptr<RegionTaker>> create(const Station& station,
                                                     const Settings& settings,
                                                     EventSink& events);
  /// Leaves the lamp dark.
  ~RegionTaker();
  RegionTaker(const RegionTaker&) = delete;
  RegionTaker& operator=(const RegionTaker&) = delete;

  /// Called before each exposure, for those who watch.
  using Watcher = std::function<void(std::chrono::nanoseconds exposure)>;

  /// The black pattern at every exposure of the ladder; for planned exposures none longer than one in which the noise of what leaks is
  /// five times that of reading, for several of these are as good, and `repeated` ones planned_blacks() times.
  Result<TakenLight> take_black(const drivers::Pattern& black,
                                bool repeated,
                                const Watcher& watcher,
                                std::stop_token stop);
  /// The exposures of one light that `choose` wants; none: a bracket. Not lit when even the longest exposure shows nothing,
  /// each time.
  Result<TakenLight> take_light(const std::string& name,
                                const drivers::Pattern& pattern,
                                const BlackFrames& black,
                                const Watcher& watcher,
                                std::stop_token stop,
                                const ChooseExposures& choose = nullptr);
  std::span<const std::chrono::nanoseconds> ladder() const { return ladder_; }
  /// What one frame at each exposure of the options takes.
  std::chrono::nanoseconds whole_ladder() const { return whole_ladder_; }
  /// Goes on with the exposures that black frames taken before are of, where take_black() would take no others.
  void use_black(const BlackFrames& black);
  /// Bytes of one raw frame.
  std::size_t frame_bytes() const;

 private:
  struct Failure {
    Error error;
    std::string fault;
  };
  Result<void> check_place(const std::string& name,
                           const TakenLight& taken,
                           const BlackFrames& black) const;
  Result<void> note_unsteady(const std::string& name, int attempt, const UnsteadyLight& unsteady);
  using Attempt = tl::expected<TakenLight, Failure>;
  using AttemptFunction = std::function<Attempt()>;
  using CaptureResult = tl::expected<CapturedFrame, Failure>;

  RegionTaker(const Station& station, const Settings& settings, EventSink& events);
  Result<void> open_devices();
  Result<void> check_sizes() const;
  Result<void> recover(std::stop_token stop);
  Result<TakenLight> with_retries(const std::string& name,
                                  const AttemptFunction& attempt,
                                  std::stop_token stop);
  std::optional<Failure> show(const drivers::Pattern& pattern, std::stop_token stop);
  CaptureResult capture(const drivers::Pattern& pattern,
                        std::size_t index,
                        std::size_t repeat,
                        const Watcher& watcher,
                        std::stop_token stop);
  Attempt attempt_black(const drivers::Pattern& black,
                        bool repeated,
                        const Watcher& watcher,
                        std::stop_token stop);
  Attempt attempt_light(const drivers::Pattern& pattern,
                        const BlackFrames& black,
                        const Watcher& watcher,
                        std::stop_token stop,
                        const ChooseExposures& choose);

  Station station_;
  Settings settings_;
  EventSink& events_;
  drivers::ProjectorInfo projector_;
  drivers::CameraInfo camera_;
  std::optional<FrameCheck> check_;
  SteadinessCheck steadiness_;
  std::optional<CapturedFrame> before_motion_;  ///< of a light in which something moved: its first
  std::vector<std::chrono::nanoseconds> ladder_;
  std::chrono::nanoseconds whole_ladder_{};
};

/// A frame without light though another of the same bracket proves that there is some: its index.
/// `lights` are of the frames in any order, `seconds` their exposures; those whose mean stands out
/// of the noise prove it.
std::optional<std::size_t> find_black_frame(std::span<const FrameLight> lights,
                                            std::span<const double> seconds);

}  // namespace opaline::capture
