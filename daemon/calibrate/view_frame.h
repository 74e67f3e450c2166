#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "calibration/viewfinder.h"

namespace opaline::daemon {

/// A frame as an operator looks at it, and what he wants to know of it.
struct ViewFrame {
  calibration::ViewFigures figures;  ///< of all its pixels
  std::vector<std::byte> png;        ///< view_picture(), at most kWidestView wide
  nlohmann::json json;  ///< exposure_s, focus, saturated, coverage, brightest, histogram
};

inline constexpr int kWidestView = 960;  ///< pixels

/// Errors: kInvalidArgument for a frame that is none.
Result<ViewFrame> view_of(const Frame& frame, double black, double clipping);

/// Means of squares of n x n pixels, the least n with which it is at most `widest` wide; a square with a sample of `full` or more has that.
Image<std::uint16_t> shrunk_codes(const Image<std::uint16_t>& picture, int widest, double full);

}  // namespace opaline::daemon
