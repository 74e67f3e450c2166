#pragma once

#include <cstdint>

#include "base/image.h"

namespace opaline::daemon {

/// The radiance that is shown as white: a quantile of the brightest channel over the pixels that
/// are lit at all.
double white_point(const Image<float>& radiance, double quantile);

/// The code of a linear value, 0 to 1, on a display, 0 to 1 (IEC 61966-2-1).
double srgb(double linear);

/// Linear radiance as an sRGB picture (IEC 61966-2-1), `white` and more as white. 3 channels.
Image<std::uint8_t> tone_mapped(const Image<float>& radiance, double white);

/// Signed difference of the channels' means, shown from -range (blue) by white to +range (red);
/// pixels that do not count are grey.
Image<std::uint8_t> difference_picture(const Image<float>& relit,
                                       const Image<float>& captured,
                                       const Image<std::uint8_t>& counts,
                                       double range);

/// The size of the difference that only a share 1 - `quantile` of the pixels exceeds.
double difference_size(const Image<float>& relit,
                       const Image<float>& captured,
                       const Image<std::uint8_t>& counts,
                       double quantile);

/// Pixels that are set become magenta.
void mark(Image<std::uint8_t>& picture, const Image<std::uint8_t>& marks);

/// The mean over squares of `factor` by `factor` pixels, for contact sheets.
Image<float> reduced(const Image<float>& picture, int factor);
/// Set where any of the pixels is.
Image<std::uint8_t> reduced_marks(const Image<std::uint8_t>& marks, int factor);

/// A 1, 2, 5 step at or above a value: 0.03 -> 0.05.
double round_up(double value);

}  // namespace opaline::daemon
