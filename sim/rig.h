#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/transport_responses.h"
#include "sim/light_timeline.h"
#include "sim/rig_options.h"
#include "sim/rig_port.h"
#include "sim/sensor.h"
#include "sim/station_light.h"

namespace opaline::sim {

/// The simulated station: a projector, a sample whose light transport is given, a camera, and the
/// clock they share.
///
///     projector codes -> patch irradiance -> sum of responses -> radiance of surface cells ->
///     camera pixels -> codes
///
/// What an exposure sees is the light that truly shone during it: one that begins before the
/// projector's latency is over shows the old pattern, or a mixture (pattern id 0). Noise, the phase
/// of the colour wheel and the error of the exposure time are keyed by seed, pattern (id and
/// content) and exposure, so a frame taken again is equal, bit by bit.
///
/// Threads: thread-safe; see RigPort for waits and errors.
class Rig : public RigPort {
 public:
  /// The clock must outlive the rig; without one it has its own, `time_factor` times as fast as
  /// real time. Errors: kInvalidArgument for options that make no sense, or responses whose sizes
  /// do not fit together.
  static Result<std::unique_ptr<Rig>> create(const RigOptions& options,
                                             std::shared_ptr<const TransportResponses> responses,
                                             Clock* clock = nullptr);
  /// The same over another light path: a light stage is a projector of its pictures' size (drivers/stage_picture.h).
  static Result<std::unique_ptr<Rig>> create(const RigOptions& options,
                                             std::shared_ptr<const LightPath> path,
                                             Clock* clock = nullptr);

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

 private:
  Rig(const RigOptions& options, std::shared_ptr<const LightPath> path, Clock* clock);

  struct Exposure;
  Result<Exposure> trigger(std::uint64_t session,
                           std::chrono::nanoseconds exposure,
                           const std::stop_token& stop);
  Result<Frame> finish(const Exposure& exposure);
  Result<Frame> fail_later(const Exposure& exposure, std::stop_token stop);
  struct Picture;
  Image<std::uint16_t> picture(const Exposure& exposure, const Picture& picture) const;
  Picture disturbed(std::vector<LightStretch> lights, std::uint64_t id);
  Result<void> deliver(const Exposure& exposure, Frame& frame);
  void end_camera_session(std::uint64_t next);
  Shown render(const drivers::Pattern& pattern);
  void darken();

  const RigOptions options_;
  std::optional<SystemClock> own_clock_;
  Clock& clock_;
  const std::shared_ptr<const LightPath> path_;
  const Sensor sensor_;

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable_any exposure_over_;
  LightTimeline timeline_;
  FaultPlan plan_;
  std::deque<std::pair<std::uint64_t, std::shared_ptr<const StationLight>>>
      rendered_;  ///< by content
  std::uint64_t next_session_;
  std::uint64_t camera_session_ = 0;     ///< 0: closed
  std::stop_source camera_session_end_;  ///< wakes the exposure of a session that ends
  std::uint64_t projector_session_ = 0;  ///< 0: closed
  std::uint64_t darkened_ = 0;           ///< how often
  int camera_opens_to_fail_ = 0;
  int projector_opens_to_fail_ = 0;
  std::uint64_t exposing_session_ = 0;  ///< 0: no exposure under way
  std::uint64_t trigger_count_ = 0;
  std::uint64_t exposures_ = 0;
  double lamp_ = 1.0;      ///< what is left of its light
  double moved_px_ = 0.0;  ///< what is seen, to the right
  std::optional<Frame> last_frame_;
};

}  // namespace opaline::sim
