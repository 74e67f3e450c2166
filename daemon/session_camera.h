#pragma once

#include "base/camera_model.h"
#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// The camera that a session's pictures were taken to the sample's surface with, lens and place, where it is not the rig file's: kept in
/// SESSION/calibration/camera.json for whoever draws what that camera sees.
Result<void> keep_camera(const SessionDirectory& session,
                         FileOperations& files,
                         const CameraModel& camera);
/// `given`, the rig file's, where none was kept. Errors: kInvalidArgument for a damaged file.
Result<CameraModel> session_camera(const SessionDirectory& session, const CameraModel& given);

}  // namespace opaline::daemon
