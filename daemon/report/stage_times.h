#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/event_log.h"

namespace opaline::daemon {

/// What a session's event log says about how it went.
struct SessionFacts {
  std::map<std::string, double> stage_seconds;  ///< all runs of a stage, killed ones up to their
                                                ///< last sign of life
  std::string begun;                            ///< when the first job started, UTC
  int runs = 0;                                 ///< of jobs, restarts included
  int regions_captured = 0;
  int regions_retaken = 0;
  std::vector<std::string> unsteady;              ///< takes of lights whose exposures did not agree
  std::string calibration;                        ///< that was used; empty: the rig file's
  std::vector<std::string> calibration_warnings;  ///< what the station said against it
  std::vector<std::string> unusable;              ///< lights that could not be used, and why

  double total_seconds() const;
};

/// A run that has not ended yet lasts until the log's last entry.
SessionFacts facts_of(const std::vector<Event>& events);

/// Seconds since 1970 of "2026-01-31T12:34:56.789Z"; 0 when it is not such a time.
double seconds_of(std::string_view utc);

}  // namespace opaline::daemon
