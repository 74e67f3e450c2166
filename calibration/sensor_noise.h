#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "calibration/response_fit.h"

namespace opaline::calibration {

/// Two exposures alike.
struct FramePair {
  const Image<std::uint16_t>* first = nullptr;   ///< outlives the call
  const Image<std::uint16_t>* second = nullptr;  ///< outlives the call
};

/// Samples of one light in one pair: codes above black of a linear sensor, and their variance, codes^2.
struct NoiseLevel {
  double mean = 0.0;
  double variance = 0.0;  ///< without that of quantisation
};

/// What a linear sensor's own noise tells of it.
struct PhotonTransfer {
  double electrons_per_code = 0.0;
  double read_noise_electrons =
      0.0;  ///< without quantisation; half a code where it is not resolved
  bool read_noise_resolved =
      true;  ///< false below half a code, where rounding is no longer noise of 1/12: it is at most that
  double electrons_per_code_deviation = 0.0;  ///< standard, of the fit
  std::vector<NoiseLevel> levels;             ///< that it was fitted to
};

/// Gain K and read noise r of one channel of a linear sensor from photon transfer (Janesick 2007, chapter 5; EMVA 1288):
/// where two frames alike have the mean m above black, half the variance of their difference is
///
///   v = m / K + (r / K)^2 + 1/12                                     codes^2
///
/// fitted over 32 bins of m of each pair, the first of what is dark, the others as wide as sqrt(m) has them, each weighing by n / (2 v^2), up to 85 % of the code range. The difference is free of fixed patterns, and as
/// sum and difference of two Poisson counts are uncorrelated, sorting pixels by the sum selects nothing. Of each bin the
/// differences beyond five standard deviations (from the median) are left out. Through a response s(f) of the fraction f of
/// the code range, m is the range times s, and (v - 1/12) is multiplied by (ds/df)^2, the slope over a 32nd of the range.
/// Errors: kInvalidArgument for shapes, and when the pairs span too little light or noise does not grow with it.
Result<PhotonTransfer> photon_transfer(std::span<const FramePair> pairs,
                                       CodeRange range,
                                       int channel,
                                       const capture::ResponseCurve& response = {});

/// A sensor in the dark.
struct DarkFrame {
  Image<float> mean;  ///< code of each sample
  Image<std::uint8_t>
      hot;  ///< 1 channel; 1: some channel stands out of the median by more than eight deviations
  double level = 0.0;     ///< median of the mean
  double temporal = 0.0;  ///< standard deviation of a sample from frame to frame, codes
  double fixed_pattern =
      0.0;  ///< standard deviation of the mean over samples that are not hot, less what temporal noise
            ///< leaves in it, codes
};

/// Measures 2 or more frames alike, taken without light. Errors: kInvalidArgument for shapes and for too few of them.
Result<DarkFrame> measure_dark(std::span<const Image<std::uint16_t>* const> frames);

}  // namespace opaline::calibration
