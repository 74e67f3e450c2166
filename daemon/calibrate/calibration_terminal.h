#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/events.h"
#include "daemon/calibrate/live_attendant.h"
#include "daemon/cli/progress_view.h"

namespace opaline::daemon {

/// A pose.taken fact (calibration/posing.h) for a terminal: what came of it, which parts of the picture have had corners, which ways the
/// board was tilted, and what to do next.
std::vector<std::string> pose_lines(const nlohmann::json& pose);

/// Shows a calibration's steps as a session's progress is shown, and tells the attendant of them.
class CalibrationTerminal : public EventSink {
 public:
  /// `view` and `attendant` outlive us. `pictures`: whether standard output is a terminal, for more than one line a pose.
  CalibrationTerminal(ProgressView& view, LiveAttendant* attendant, bool pictures)
      : view_(view), attendant_(attendant), pictures_(pictures) {}
  void progress(const Progress& p) override;
  Result<void> fact(std::string_view type, const nlohmann::json& data) override;

 private:
  ProgressView& view_;
  LiveAttendant* attendant_;
  bool pictures_;
};

}  // namespace opaline::daemon
