#pragma once

#include <array>
#include <cstdint>

#include "base/image.h"
#include "base/result.h"

namespace opaline::calibration {

/// What an operator wants to know of a picture before anything is measured.
struct ViewFigures {
  static constexpr int kBins = 64;
  /// Mean squared difference of pixels two apart in green, less what noise makes of it, over the squared mean, of the lit part
  /// (Brenner et al. 1976): greatest where the picture is sharpest, whatever the exposure.
  double focus = 0.0;
  std::array<double, 3> saturated{};  ///< share of the pixels at 98 % of the range or more
  double lit = 0.0;        ///< share of the pixels above 5 % of the range in some channel: coverage
  double brightest = 0.0;  ///< 99.9 % quantile of all samples, share of the range
  std::array<std::array<double, kBins>, 3>
      histogram{};  ///< shares of the pixels, from black to clipping
};

/// Errors: kInvalidArgument unless the picture has three channels and some pixels, and `clipping` lies above `black`.
/// `noise_variance`: of a sample, codes^2, where it is known.
Result<ViewFigures> view_figures(const Image<std::uint16_t>& picture,
                                 double black,
                                 double clipping,
                                 double noise_variance = 0.0);

/// As people look at it: black to clipping with a gamma of 2.2, saturated pixels magenta, and below it the histogram of each
/// channel, a strip 64 pixels high.
Image<std::uint8_t> view_picture(const Image<std::uint16_t>& picture,
                                 double black,
                                 double clipping,
                                 const ViewFigures& figures);

}  // namespace opaline::calibration
