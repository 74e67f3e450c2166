#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/camera.h"
#include "drivers/projector.h"

namespace opaline::conformance {

/// A camera and a projector under test, and what can be done to them from outside. One driver is one subclass.
class DeviceBench {
 public:
  virtual ~DeviceBench() = default;
  virtual drivers::Camera& camera() = 0;
  virtual drivers::Projector& projector() = 0;
  /// Unplug, so that the next exposure or pattern finds the device gone; plug() brings it back.
  virtual void unplug_camera() = 0;
  virtual bool can_unplug_projector() const { return true; }
  virtual void unplug_projector() {}
  virtual void plug() = 0;
  /// The next exposure's frame never comes.
  virtual void lose_frame() {}
  /// Whether an exposure takes as long as asked for, in real time; then its frame can be lost, and so can its camera
  /// while it lasts.
  virtual bool keeps_time() const { return true; }
};

struct Driver {
  std::string name;
  std::function<std::unique_ptr<DeviceBench>()> make;
};

std::unique_ptr<DeviceBench> make_sim_bench();     ///< the simulated station in this process
std::unique_ptr<DeviceBench> make_socket_bench();  ///< the same behind a socket
std::unique_ptr<DeviceBench> make_replay_bench();  ///< a folder of photographs

}  // namespace opaline::conformance
