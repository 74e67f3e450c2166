#pragma once

#include <array>

#include "base/pose.h"
#include "calibration/record.h"
#include "capture/calibration.h"

namespace opaline::calibration {

/// What a capture should believe: `given`, with the camera's black level, response, clipping, gain, read noise, exposure times, hot pixels,
/// vignetting and lens, and the projector's gamma, black level and vignetting, as measured; the camera's place stays as given, and a
/// projector in perspective stands by it (with_place). The sensitivity follows the gain, so that codes per radiance, which is what the one
/// who gave it had measured, stay as given.
capture::StationCalibration with_measured(capture::StationCalibration given,
                                          const Measured& measured);

/// The same with the camera's place before the sample, and its covariance (CameraCalibration::place_covariance). A projector in
/// perspective has its lens as measured, where it was, and goes with the camera:
///
///   projector_from_sample = projector_from_camera camera_from_sample,   w_projector = R w,   s_projector = R s
///
/// with R the rotation of projector_from_camera, and (w, s) a small motion of what the camera sees. How well boards tell
/// projector_from_camera is no part of the covariance. A perpendicular projector, and one that no board has measured, stay as given.
capture::StationCalibration with_place(capture::StationCalibration given,
                                       const Measured& measured,
                                       const Pose& camera_from_sample,
                                       const std::array<double, 36>& covariance);

}  // namespace opaline::calibration
