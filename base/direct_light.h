#pragma once

#include <cstdint>

#include "base/block.h"
#include "base/image.h"

namespace opaline {

/// Clears the cells of a face that light falls on, and those whose middle lies within `margin_mm` of
/// a lit cell's edge: there a picture of the lit face shows more than diffused light.
///
/// Shapes: `irradiance` (any channel > 0 is lit) and `mask` (1 channel) are rasters over that face.
void mask_direct_light(const Block& block,
                       Face face,
                       const Image<float>& irradiance,
                       double margin_mm,
                       Image<std::uint8_t>& mask);

}  // namespace opaline
