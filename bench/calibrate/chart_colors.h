#pragma once

#include "base/result.h"
#include "calibration/color_fit.h"

namespace opaline::bench {

/// Colours of a simulated ColorChecker, found in the noisy picture and corrected by patches other than themselves, at three
/// exposures of which one tells the correction.
struct ChartColors {
  calibration::ColorError matrix;
  calibration::ColorError root_polynomial;
};
Result<ChartColors> chart_colors();

}  // namespace opaline::bench
