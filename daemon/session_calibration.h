#pragma once

#include <filesystem>
#include <stop_token>

#include "base/events.h"
#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "capture/station.h"
#include "config/rig_config.h"

namespace opaline::daemon {

/// What a session believes of its station: the rig file, and over it the calibration that is active when the session's capture
/// first begins. That one is asked of the station (calibration::compare_with_station) and copied to
/// SESSION/calibration/calibration.json, so that a session that goes on later, or after another calibration, keeps its own.
/// A session without that file whose capture has begun goes on as it began, by the rig file.
///
/// Where the rig file has a holder, and calibrations are used at all, the camera's place before the sample, with its covariance, is by that
/// (calibration::find_sample), measured at the same moment and kept in SESSION/calibration/placement.json.
///
/// A projector in perspective that was measured goes with the camera (calibration::with_place).
///
/// Camera lens and place that come out of it are kept for those who draw (session_camera.h).
///
/// Facts: calibration.used {version, created, message}, calibration.warning {message} for each doubt, placement.measured {corners,
/// rms_px, deviation_mm, from_rig_file_mm, message}.
/// Errors: kInvalidArgument, with the remedy, for a calibration that the station contradicts; and what devices and disk return.
Result<capture::StationCalibration> session_calibration(const SessionDirectory& session,
                                                        const config::RigConfig& rig,
                                                        const std::filesystem::path& calibrations,
                                                        const capture::Station& station,
                                                        FileOperations& files,
                                                        EventSink& events,
                                                        std::stop_token stop);

}  // namespace opaline::daemon
