#pragma once

#include <string>

#include "calibration/record.h"

namespace opaline::daemon {

/// The patches of a ColorChecker as <figure>: each as it is published, and within it as the correction has the camera see it. Colours are
/// those of CIELAB under D50 (calibration/color_difference.h) on an sRGB screen. Empty where the step "colour" has not been done.
std::string patch_swatches(const calibration::Record& record);

}  // namespace opaline::daemon
