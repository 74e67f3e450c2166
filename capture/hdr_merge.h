#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/exposure_plan.h"

namespace opaline::capture {

/// One exposure of a light and the black pattern at the same exposure.
struct ExposurePair {
  const Image<std::uint16_t>* light = nullptr;  ///< outlives the pair
  const Image<std::uint16_t>* black = nullptr;  ///< outlives the pair
  double light_seconds = 0.0;                   ///< as measured
  double black_seconds = 0.0;
};

/// Radiance as the camera saw it, 3 channels, camera pixels.
struct HdrImage {
  Image<float> radiance;          ///< W/(mm^2 sr)
  Image<float> variance;          ///< of it, > 0
  Image<std::uint8_t> mask;       ///< 1: usable in all channels; 0: saturated or hot
  Image<std::uint8_t> saturated;  ///< 1: some channel clipped even in the shortest exposure
};

/// Merges a bracket with the Poisson-noise estimator (Hanji, Zhong, Mantiuk 2020, Eq. 9): with
/// electrons e_i above black and exposure t_i, the rate is
///
///   sum_i w_i e_i / sum_i w_i t_i
///
/// so each exposure weighs by its time, which needs no noise parameter and has no bias. w_i falls
/// linearly from 1 to 0 between 65 % and 95 % of the codes up to clipping (1 throughout in the
/// shortest exposure): a hard limit on noisy codes would select the low ones. The variance is that of the
/// sum under the camera's noise model, evaluated at the estimate: shot noise of light and leak,
/// read noise and quantisation, of both frames of each pair.
class HdrMerge {
 public:
  /// `hot` marks pixels (1) to leave out.
  HdrMerge(const CameraCalibration& camera, Image<std::uint8_t> hot);
  /// 1 to kMaxExposures pairs, in any order, all of the camera's size.
  HdrImage merge(std::span<const ExposurePair> bracket) const;

 private:
  struct Sample {
    double rate = 0.0;  // electrons per second
    double variance = 0.0;
    bool saturated = false;
  };
  Sample merge_sample(std::span<const ExposurePair> sorted, int x, int y, int channel) const;
  CameraCalibration camera_;
  Image<std::uint8_t> hot_;
  Image<float> vignetting_;
  std::vector<Electrons> electrons_;  // by code
  double clipping_code_;
};

/// Light of one exposure above black, over the pixels where `footprint` is 1. Samples whose black
/// frame is clipped already, by what leaks, tell nothing of it; where all are, it is too bright.
struct FrameLight {
  ExposureStatistics statistics;
  double clipped_share = 0.0;   ///< of samples: saturated, and not by what leaks
  double mean_electrons = 0.0;  ///< above black; a clipped pixel counts as what it clipped at
  double mean_deviation = 0.0;  ///< standard deviation of that mean, from noise alone; 0: untold
  bool stands_out() const { return mean_electrons > 8.0 * mean_deviation; }
  bool tells() const { return mean_deviation > 0.0; }
  bool lit() const {
    return clipped_share > 0.0 || stands_out() || (!tells() && statistics.saturated_share > 0.0);
  }
};
/// `footprint` without hot pixels: one that saturates counts as light.
FrameLight measure_light(const CameraCalibration& camera,
                         const ExposurePair& pair,
                         const Image<std::uint8_t>& footprint,
                         double dark_quantile);

/// Known hot pixels and those that stand out of the median of their neighbours by more than eight
/// standard deviations in any of the black frames: 1 channel, 1 = hot.
Image<std::uint8_t> find_hot_pixels(const CameraCalibration& camera,
                                    std::span<const Image<std::uint16_t>* const> black_frames);

}  // namespace opaline::capture
