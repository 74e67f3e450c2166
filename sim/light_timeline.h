#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "sim/station_light.h"

namespace opaline::sim {

/// A pattern as the lamp shows it.
struct ShownPattern {
  std::uint64_t id = 0;
  std::uint64_t content = 0;  ///< a hash of its codes
  std::shared_ptr<const StationLight> light;
};
using Shown = std::shared_ptr<const ShownPattern>;  ///< null: dark

/// A stretch of an exposure under one light; seconds count from the exposure's start.
struct LightStretch {
  Shown shown;
  double from_seconds = 0.0;
  double to_seconds = 0.0;
};

/// Which light shone when. Changes may lie in the future (latency); a new one replaces all that
/// were to come after it. Not thread-safe.
class LightTimeline {
 public:
  void change(std::chrono::nanoseconds when, Shown shown);
  Shown at(std::chrono::nanoseconds when) const;
  /// The pattern before the one shown at that time.
  Shown before(std::chrono::nanoseconds when) const;
  /// The lights of an exposure, in order; it must not lie further back than the last 256 changes.
  std::vector<LightStretch> during(std::chrono::nanoseconds start,
                                   std::chrono::nanoseconds duration) const;

 private:
  struct Change {
    std::chrono::nanoseconds when;
    Shown shown;
  };
  std::deque<Change> changes_;  ///< by time
};

}  // namespace opaline::sim
