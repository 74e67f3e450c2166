#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/image.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/projector.h"
#include "sim/faults.h"
#include "sim/optics.h"

namespace opaline::sim {

/// What anybody may know about the station from outside.
struct RigStatus {
  std::string identity;  ///< as in RigOptions
  bool lamp_on = false;
  std::uint64_t pattern_id = 0;  ///< being shown; 0 = none
  std::uint64_t exposures = 0;   ///< taken since the rig was built
  bool camera_open = false;
  bool projector_open = false;
  std::chrono::nanoseconds rig_time{};  ///< on the rig's clock
  double time_factor = 1.0;
  Faults faults;  ///< still to come
};

/// What no real station could tell: the truth behind the picture of the pattern being shown.
struct RigTruth {
  std::string scene;  ///< what the sample is, as TransportResponses says
  std::uint64_t pattern_id = 0;
  int patches_x = 0;
  int patches_y = 0;
  std::vector<Rgb> patch_irradiance;  ///< E on the lit face, W/mm^2, column fastest
  Image<float>
      surface_radiance;  ///< L on the seen face's cells towards the camera, W/(mm^2 sr), 3 channels
};

/// The simulated station's connectors: what its camera's and its projector's drivers plug into, in
/// the same process (Rig) or through a socket (RigClient).
///
/// Threads: thread-safe.
/// Waits:   expose() as drivers::Camera says, on the rig's clock; all others 2 s at most.
/// Errors:  kUnavailable when the device is lost, closed or since opened by somebody else, or the rig is not there;
///          kBusy for an exposure during another.
class RigPort {
 public:
  static constexpr std::uint64_t kAnybody = 0;  ///< a session that nobody has, for dark()

  template <class Info>
  struct Opened {
    std::uint64_t session = 0;  ///< names this opening in later calls
    Info info;
  };

  virtual ~RigPort() = default;
  /// Opening a device takes it from whoever had it. The camera's trigger count starts again; the
  /// lamp goes dark.
  virtual Result<Opened<drivers::CameraInfo>> open_camera() = 0;
  virtual Result<Opened<drivers::ProjectorInfo>> open_projector() = 0;
  virtual Result<Frame> expose(std::uint64_t session,
                               std::chrono::nanoseconds exposure,
                               std::stop_token stop) = 0;
  virtual Result<void> show(std::uint64_t session,
                            const drivers::Pattern& pattern,
                            std::stop_token stop) = 0;
  virtual void close_camera(std::uint64_t session) noexcept = 0;
  virtual void close_projector(std::uint64_t session) noexcept = 0;  ///< leaves the lamp dark
  /// Lamp off, whoever asks. A show() under way is overtaken: it returns kCancelled and lights nothing. Unless the
  /// projector's own session asks, that session ends, so that no pattern on its way lights the lamp again.
  virtual Result<void> dark(std::uint64_t session) = 0;
  virtual Result<RigStatus> status() = 0;
  virtual Result<RigTruth> truth() = 0;
  /// Replaces the faults to come.
  virtual Result<void> arm(const Faults& faults) = 0;
  /// Adds to them.
  virtual Result<void> add(const Faults& faults) = 0;
};

}  // namespace opaline::sim
