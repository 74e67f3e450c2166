#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/color_checker.h"
#include "base/image.h"
#include "base/result.h"
#include "calibration/color_fit.h"

namespace opaline::calibration {

/// A ColorChecker in a picture.
struct FoundChart {
  /// The outline of its patches, px: upper left, upper right, lower right, lower left of the chart itself.
  std::array<std::array<double, 2>, 4> corners{};
  std::array<CameraRgb, 24>
      patches{};  ///< mean code above black over the middle of each, in the order of kColorChecker
  std::array<double, 24> clipped{};  ///< share of its samples that are full in some channel
  int smallest_px = 0;               ///< pixels that the smallest patch was measured over
};

/// Finds a chart of 24 patches (OpenCV's `mcc`: squares of one size in a lattice) and measures its patches, over the middle
/// 30 % of each way. It may lie on its side or upside down: of the four ways round, that is taken which a correction to the
/// references fits best.
/// Shapes: 3 channels, linear; `clipping` is the code where pixels are full.
/// Errors: kInvalidArgument for a picture that makes no sense. Not to find one is an answer.
Result<std::optional<FoundChart>> find_chart(const Image<std::uint16_t>& picture,
                                             double black,
                                             double clipping);

}  // namespace opaline::calibration
