#pragma once

#include <cstdint>

#include "base/image.h"
#include "base/result.h"
#include "capture/hdr_merge.h"

namespace opaline::capture {

/// Pixels that see the object: brighter than a share of `white`, the radiance of a white surface, under the constant pattern; mean of the channels. 1 or 0.
/// Errors: kUnavailable below a hundred of them.
Result<Image<std::uint8_t>> brighter_pixels(const HdrImage& constant, double share, double white);

/// Sum of the channels' mean over the pixels that are measured and in `footprint` (not 0).
double light_in(const HdrImage& hdr, const Image<std::uint8_t>& footprint);

}  // namespace opaline::capture
