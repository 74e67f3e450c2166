#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "base/result.h"
#include "capture/capture_options.h"

namespace opaline::capture {

/// The most exposures of one light.
inline constexpr std::size_t kMaxExposures = 64;

/// What a station can expose.
struct ExposureLimits {
  std::chrono::nanoseconds wheel_period{};  ///< of the projector; 0: any exposure will do
  std::chrono::nanoseconds shortest{};      ///< of the camera
  std::chrono::nanoseconds longest{};       ///< of the camera
};

/// The exposures a bracket may use, shortest first, each about `ratio` times the one before and a
/// whole number of turns of the colour wheel, since a part of a turn would not mix the colours
/// right. The last is the longest allowed.
/// Errors: kInvalidArgument when no whole turn lies between the limits, or when so small a ratio
/// takes more than kMaxExposures from one to the other.
Result<std::vector<std::chrono::nanoseconds>> exposure_ladder(const ExposureOptions& options,
                                                              const ExposureLimits& limits);

/// Frames of one exposure, counted from 0, are each exposed for 100 ns longer than the one before, so that none can pass
/// for another.
std::chrono::nanoseconds repeated_exposure(std::chrono::nanoseconds exposure, std::size_t repeat);
/// How many black frames of an exposure planned lights are taken with: as many as eight seconds hold, 1 to 8, and no
/// more than kMaxExposures with the rest of the ladder. All lights share them, so they are worth more than a light's own frames.
int planned_blacks(std::chrono::nanoseconds exposure, std::size_t ladder_size);
/// Whether one is a repetition of the other.
bool same_exposure(std::chrono::nanoseconds a, std::chrono::nanoseconds b);

/// What one frame says about its exposure, over the camera pixels that see the sample.
struct ExposureStatistics {
  double saturated_share = 0.0;  ///< of pixels
  double dark_snr = 0.0;         ///< of a pixel at the dark quantile
};

/// Chooses the exposures of one region: starts in the middle of the ladder, goes shorter while
/// pixels are saturated, then longer while the dark pixels are noisier than wanted. The same frames
/// give the same choice.
class Bracket {
 public:
  Bracket(const ExposureOptions& options, std::size_t ladder_size);
  /// Index into the ladder of the exposure to take next; none when the bracket is complete.
  std::optional<std::size_t> next() const;
  /// Adds what next() asked for.
  void add(std::size_t index, const ExposureStatistics& statistics);

 private:
  double wanted_snr_;
  std::size_t size_;
  std::size_t lowest_ = 0;
  std::size_t highest_ = 0;
  bool empty_ = true;
  ExposureStatistics at_lowest_;
  ExposureStatistics at_highest_;
};

}  // namespace opaline::capture
