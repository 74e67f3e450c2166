#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/result.h"
#include "calibration/color_correction.h"
#include "calibration/color_difference.h"

namespace opaline::calibration {

/// Factors that make `white` grey, green staying as it is. Errors: kInvalidArgument where a channel has no light.
Result<CameraRgb> balance_white(const CameraRgb& white);

/// The correction whose colours are next to the references: least squares of XYZ first, then of CIELAB (Gauss and Newton), in
/// which equal errors look alike. Twice as many patches as terms, at least.
/// Errors: kInvalidArgument for shapes, and for colours that do not determine it.
Result<ColorCorrection> fit_color(ColorModel model,
                                  const CameraRgb& white_balance,
                                  std::span<const CameraRgb> patches,
                                  std::span<const Lab> references);

/// How far off colours are that the fit did not know: each patch by a correction from all others.
struct ColorError {
  std::vector<double> patches;  ///< CIEDE2000 of each, the mean over what it was tested on
  double mean = 0.0;
  double p95 = 0.0;
  double most = 0.0;
};
/// `tests`: the patches once more, or more than once, as other exposures have them, in the same unit; mean, 95 % quantile and
/// maximum are over all of these. Empty: the patches themselves. Errors: as fit_color.
Result<ColorError> leave_one_out(ColorModel model,
                                 const CameraRgb& white_balance,
                                 std::span<const CameraRgb> patches,
                                 std::span<const Lab> references,
                                 std::span<const std::vector<CameraRgb>> tests);

/// Which camera channel sees which colour: the permutation of channels that follow red, green and blue of the references best.
/// {0, 1, 2} is as it should be.
std::array<int, 3> channel_order(std::span<const CameraRgb> patches,
                                 std::span<const Lab> references);

}  // namespace opaline::calibration
