#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/exposure_plan.h"

namespace opaline::capture {

struct ToldBlack;

/// One exposure of a light and the black pattern at the same exposure.
struct ExposurePair {
  const Image<std::uint16_t>* light = nullptr;  ///< outlives the pair
  const Image<std::uint16_t>* black = nullptr;  ///< outlives the pair
  double light_seconds = 0.0;                   ///< as measured
  double black_seconds = 0.0;
  /// Further black frames of that exposure, which are averaged with it; they outlive the pair.
  std::span<const Image<std::uint16_t>* const> more_black = {};
  const ToldBlack* told = nullptr;  ///< instead of all these, where it tells; outlives the pair
};
/// Of one sample of `mean` electrons, light and leak, where neighbouring codes lie `per_code` apart: shot noise, read noise, and
/// quantisation to whole codes; electrons^2.
double noise_variance(const CameraCalibration& camera, double mean, double per_code);
/// electrons_from_code() of every 16-bit code.
std::vector<Electrons> electrons_by_code(const CameraCalibration& camera);

/// Black of one exposure, and the mean of how many frames would be known as well.
struct BlackSample {
  Electrons electrons;
  double frames = 1.0;
};
/// `sample` counts the picture's samples, row by row; `electrons` is by code.
BlackSample black_of(const ExposurePair& pair,
                     std::size_t sample,
                     std::span<const Electrons> electrons);

/// Radiance as the camera saw it, 3 channels, camera pixels.
struct HdrImage {
  Image<float> radiance;          ///< W/(mm^2 sr)
  Image<float> variance;          ///< of it, > 0
  Image<std::uint8_t> mask;       ///< 1: usable in all channels; 0: saturated or hot
  Image<std::uint8_t> saturated;  ///< 1: some channel clipped even in the shortest exposure
};

/// Merges a bracket by maximum likelihood in two steps (compound-Gaussian noise, Granados et al. 2010, Sec. 4): with net
/// electrons n_i above black, of variance v_i at exposure t_i, the rate is
///
///   sum_i w_i n_i / sum_i w_i t_i        w_i = t_i / v_i(first estimate)
///
/// where the first estimate is the same sum with w_i = 1, which needs no noise parameter and has no bias (Hanji, Zhong,
/// Mantiuk 2020, Eq. 9). v_i is the camera's noise model: shot noise of light and leak, read noise and quantisation, of both
/// frames of the pair, the leak being that of all black frames together, so that no weight follows the noise of its own
/// black. Several frames less the same black frame are averaged first: one term, of the light's noise over their number. The variance returned is 1 / sum_i t_i^2 / v_i at the result: the Cramer-Rao bound of the exposures used.
///
/// Whether an exposure is used must not depend on the noise of what it would add, or low codes are selected. So a sample
/// near clipping is judged by the mean of its eight neighbours in the same frame: used where that mean and three
/// standard deviations stay below clipping. Where the sample differs from it by more than noise, as at edges, w_i falls
/// linearly with the sample's own code from 65 % to 95 % of the codes up to clipping. The shortest exposure is always used.
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
  struct Term {  // frames of one exposure, less the black frame that they share: their means
    double weight = 0.0, seconds = 0.0, black_seconds = 0.0;
    double net = 0.0, per_code = 0.0, black_per_code = 0.0;
    double frames = 1.0;
    double blacks = 1.0;
    const Image<std::uint16_t>* black = nullptr;
    void add(double other_weight, double other_seconds, double other_net);
  };
  Sample merge_sample(std::span<const ExposurePair> sorted, int x, int y, int channel) const;
  double weight_in(const Image<std::uint16_t>& frame, int x, int y, int channel) const;
  std::optional<double> mean_around(const Image<std::uint16_t>& frame,
                                    int x,
                                    int y,
                                    int channel) const;
  double variance_of(const Term& term, double rate, double leak_rate) const;
  CameraCalibration camera_;
  Image<std::uint8_t> hot_;
  Image<float> vignetting_;
  std::vector<Electrons> electrons_;  // by code
  double clipping_code_;
  double clipping_electrons_;
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
