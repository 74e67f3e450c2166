#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/frame.h"
#include "base/image.h"
#include "calibration/response_fit.h"
#include "capture/calibration.h"

namespace opaline::calibration {

/// What a shutter does, by the light that a stack of exposures collected.
struct ExposureTimes {
  struct One {
    double reported = 0.0;   ///< seconds, as the camera says
    double factor = 1.0;     ///< what it was, over that
    double deviation = 0.0;  ///< standard, of the factor
  };
  std::vector<One> exposures;  ///< those that enough samples tell of; shortest first
  double largest_error = 0.0;  ///< of all factors, from 1
  /// Those that are off by more than three deviations and 0.05 %, the others as 1; empty where none is.
  std::vector<capture::ExposureFactor> corrections() const;
};

/// Measures exposures against each other, two frames of each, shortest first: each is as many times the one before as the sum
/// of linear codes above black over the samples that both tell of. The samples are chosen by the second frames and summed in
/// the first, so that noise chooses none. A scale common to all cannot be told from the light: the median factor is 1.
/// `linear` takes codes to such of a linear sensor, black at 0; `good` marks (1) pixels that are not hot.
ExposureTimes measure_exposures(std::span<const Frame> first,
                                std::span<const Frame> second,
                                CodeRange range,
                                std::span<const double> linear,
                                const Image<std::uint8_t>& good);

}  // namespace opaline::calibration
