#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "base/clock.h"
#include "base/events.h"

namespace opaline::daemon {

/// Says how far a step is, and how long it still takes if the rest goes as fast as what is done.
class StepProgress {
 public:
  StepProgress(EventSink& events, const Clock& clock, std::string step)
      : events_(events), clock_(clock), step_(std::move(step)), start_(clock.now()) {
    done(0.0);
  }
  void done(double share, const nlohmann::json& detail = nlohmann::json::object()) {
    Progress progress{step_, share, {}, detail};
    if (share > 0.0) {
      const std::chrono::duration<double> spent = clock_.now() - start_;
      progress.seconds_left = spent.count() * (1.0 - share) / share;
    }
    events_.progress(progress);
  }

 private:
  EventSink& events_;   // outlives us
  const Clock& clock_;  // outlives us
  std::string step_;
  std::chrono::nanoseconds start_;
};

}  // namespace opaline::daemon
