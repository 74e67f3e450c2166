#pragma once

#include <optional>
#include <span>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/hdr_merge.h"

namespace opaline::capture {

/// A black frame as white light tells it.
struct ToldBlack {
  /// 3 channels; NaN at pixels that do not see the sample, or where white clips.
  Image<float> electrons;
  int blacks = 1;  ///< the mean of so many black frames would be known as well
};

/// What leaks while the black pattern shows, told by white light. At code 0 a projector sends a small share of what it sends at
/// code 255, by the same ways through the sample. A black frame of t seconds is therefore, in electrons of a channel,
///
///   black(p) = t W(p) sum_k a_k phi_k(p) + d        phi = 1, x, y, x^2, x y, y^2 of the picture, x and y from -1 to 1
///
/// with W(p) the light of the white picture, electrons a second. The white picture is a thousand times as bright as the black one: some
/// short frames of it tell W(p) so well that seven numbers, a_k (a share that changes slowly over the picture) and d (dark current
/// and what is left of the black level), are all that black frames must tell: least squares over every pixel that sees the sample.
///
/// `blacks` are frames of one exposure, `white` pairs of the white picture with black frames of theirs, `seen` marks the pixels (1) that see the
/// sample. None where the black is something else: squares of what is left, over those of the noise, above 1.25 for single pixels or
/// 1.5 for means of 8 x 8 pixels; or where white clips on more than 2 % of the pixels, or so few pixels see the sample that the frames themselves
/// tell more.
///
/// How well it is known: by the noise of W, and by that of the seven numbers, which all pixels of a surface cell share and which therefore
/// counts as often as it may have pixels (16).
std::optional<ToldBlack> tell_black(const CameraCalibration& camera,
                                    std::span<const Image<std::uint16_t>* const> blacks,
                                    double black_seconds,
                                    std::span<const ExposurePair> white,
                                    const Image<std::uint8_t>& seen);

}  // namespace opaline::capture
