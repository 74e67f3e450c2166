#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "calibration/response_fit.h"

/// What fit_response() learns from: the pixels of a stack that tell of the response.
namespace opaline::calibration {

/// One exposure's code of a pixel.
struct ResponseSample {
  std::size_t exposure = 0;
  double fraction = 0.0;
  double weight = 0.0;
  double target = 0.0;  ///< ln t - ln f
};

struct ResponsePixel {
  std::vector<ResponseSample> samples;
  double trust = 1.0;
  double residual = 0.0;
};

struct ResponsePixels {
  std::vector<ResponsePixel> telling;
  int refused = 0;
};

/// The fraction of the range below which noise would be mistaken for light.
double lowest_fraction(CodeRange range);
/// Of an even choice of some thousand pixels, those with two samples or more between lowest_fraction() and clipping; stuck ones are refused.
ResponsePixels collect_pixels(std::span<const Exposure> stack, CodeRange range, int channel);
/// Errors: kInvalidArgument for shapes, times, or a channel that is not there.
Result<void> check_stack(std::span<const Exposure> stack, CodeRange range, int channel);
/// Errors: kInvalidArgument when they are too few, or tell of too little of the range.
Result<void> check_told(const ResponsePixels& pixels, CodeRange range);

}  // namespace opaline::calibration
