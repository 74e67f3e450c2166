#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "calibration/board.h"

namespace opaline::calibration {

/// Sinusoids that tell each camera pixel which place of the projector's picture lights it. For each axis and each of `periods`, the
/// longest longer than the picture, `steps` patterns k = 0, 1, ...
///
///   light_k = 1/2 + 1/2 cos(2 pi (x / period - k / steps)),   code = white light^(1/gamma)
///
/// with x in projector pixels. From the light I_k that a pixel sees,
///
///   phase = atan2(sum I_k sin(2 pi k / steps), sum I_k cos(2 pi k / steps)),   modulation = 2/steps |sum I_k exp(2 pi i k / steps)|
///
/// and each period's phase chooses the turn of the next shorter one (temporal unwrapping; Huntley & Saldner 1993).
struct PhasePlan {
  int width = 640;  ///< of the projector's picture
  int height = 480;
  double gamma = 2.2;
  std::uint8_t white = 255;                                   ///< the code of the most light
  std::vector<double> shares{1.25, 1.25 / 8.0, 1.25 / 48.0};  ///< periods over the longer side
  int steps = 4;

  int count() const { return 2 * static_cast<int>(shares.size()) * steps; }
  double period(std::size_t level) const;
};

/// The grey codes of one of `plan.count()` patterns, one channel.
Image<std::uint8_t> phase_pattern(const PhasePlan& plan, int index);

/// Where on the projector's picture each camera pixel is lit from.
struct ProjectorMap {
  Image<float> x;  ///< projector pixels; NaN where there is too little light to tell
  Image<float> y;
  Image<float>
      modulation;     ///< of the shortest period, the lesser of both axes, in units of the pictures
  Image<float> mean;  ///< of all pictures: the scene under even light, with little noise
};

/// From linear pictures of all patterns in order. `least` is the modulation below which nothing is told. Errors: kInvalidArgument when
/// their number or sizes differ.
Result<ProjectorMap> decode_phases(const PhasePlan& plan,
                                   std::span<const Image<float>> pictures,
                                   double least);

/// The corners of a camera's view where the projector would see them, by local homographies (Moreno & Taubin 2012): camera pixels within
/// 0.9 of the corners' distance that lie inside white squares, away from their edges, and are well lit tell the plane's homography from
/// camera to projector there, which takes the corner along. Corners with too few such pixels, or whose pixels scatter by more than half a
/// projector pixel, are left out.
BoardView projector_view(const ProjectorMap& map, const BoardView& camera_view, const Board& board);

}  // namespace opaline::calibration
