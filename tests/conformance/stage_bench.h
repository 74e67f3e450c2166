#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/light_stage.h"

namespace opaline::conformance {

/// A light stage under test, and what can be done to it from outside. One driver is one subclass.
class StageBench {
 public:
  virtual ~StageBench() = default;
  virtual drivers::LightStage& stage() = 0;
  /// Unplug, so that the next pattern finds the device gone; plug() brings it back.
  virtual void unplug() = 0;
  virtual void plug() = 0;
  /// Whether no light shines, or is about to, as somebody sees who is not the driver.
  virtual bool is_dark() = 0;
};

struct StageDriver {
  std::string name;
  std::function<std::unique_ptr<StageBench>()> make;
};

std::unique_ptr<StageBench> make_udmx_bench();          ///< two interfaces whose firmware is played
std::unique_ptr<StageBench> make_sim_stage_bench();     ///< the simulated sphere in this process
std::unique_ptr<StageBench> make_socket_stage_bench();  ///< the same behind a socket

}  // namespace opaline::conformance
