#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace opaline::daemon {

/// Which calibrations `opaline calibration` speaks of.
struct CalibrationPlace {
  std::filesystem::path root;  ///< of all stations
  std::string station;         ///< empty: the only one there is
};

/// Each prints to standard output. `version` 0: the active one.
/// Errors: kNotFound for a station or version that is not there, naming those that are; kInvalidArgument for one that was
/// not accepted, is damaged or of a newer version.
Result<void> list_calibrations(const CalibrationPlace& place);
Result<void> show_calibration(const CalibrationPlace& place, int version);
Result<void> activate_calibration(const CalibrationPlace& place, int version);
/// Activates the newest version below the active one that was active before.
Result<void> roll_back_calibration(const CalibrationPlace& place);
Result<void> diff_calibrations(const CalibrationPlace& place, int before, int after);

}  // namespace opaline::daemon
