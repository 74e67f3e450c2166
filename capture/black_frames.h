#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/frame_store.h"
#include "capture/hdr_merge.h"
#include "capture/told_black.h"

namespace opaline::capture {

/// Black frames by exposure, to subtract, and what they tell of the pixels. With frames of the white picture they may be told by those
/// (told_black.h), of every exposure or of none.
class BlackFrames {
 public:
  BlackFrames() = default;
  BlackFrames(BlackFrames&&) = default;
  BlackFrames& operator=(BlackFrames&&) = default;
  ~BlackFrames() = default;
  /// `seen` marks the pixels (1) that see the sample.
  BlackFrames(std::vector<CapturedFrame> frames,
              const CameraCalibration& camera,
              const Image<std::uint8_t>& seen,
              std::span<const CapturedFrame> white = {});
  /// Whether white light tells them.
  bool told() const { return !told_.empty(); }
  bool empty() const { return frames_.empty(); }
  /// Whether there is a black of each of these exposures.
  bool cover(std::span<const std::chrono::nanoseconds> exposures) const;
  /// Of these exposures, how many it takes until what leaks is well above the read noise; all where it never is.
  std::size_t useful(std::span<const std::chrono::nanoseconds> exposures,
                     const CameraCalibration& camera) const;
  /// Of each of these exposures, how many black frames' mean would be known as well as what is subtracted.
  std::vector<int> worth(std::span<const std::chrono::nanoseconds> exposures) const;
  /// Hot pixels: 1.
  const Image<std::uint8_t>& hot() const { return hot_; }
  /// Pixels that see the sample and are not hot: 1. Only these tell light from dark, since a hot
  /// one saturates in a long exposure without any light.
  const Image<std::uint8_t>& footprint() const { return footprint_; }
  /// The pair of a frame with the blacks of its exposure, their times as exposed_seconds() has them; none when there is no such black. We outlive the pair.
  std::optional<ExposurePair> pair(const CapturedFrame& light) const;

 private:
  void tell(std::span<const CapturedFrame> white);
  using Pictures = std::vector<const Image<std::uint16_t>*>;
  std::vector<CapturedFrame> frames_;
  CameraCalibration camera_;
  std::vector<Pictures> others_;  ///< of each frame: those of the same exposure
  std::vector<ToldBlack> told_;   ///< of each frame; empty: none
  Image<std::uint8_t> hot_;
  Image<std::uint8_t> footprint_;
};

/// Whether shot noise of what leaks is well above the noise of reading a frame.
bool leak_dominates(const CameraCalibration& camera, const Image<std::uint16_t>& black);

}  // namespace opaline::capture
