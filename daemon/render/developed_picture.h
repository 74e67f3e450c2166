#pragma once

#include <cstdint>
#include <filesystem>

#include "base/image.h"
#include "base/io/image_io.h"
#include "base/result.h"
#include "render/scene/scene.h"

namespace opaline::daemon {

/// A rendered picture as a file.
///
///   .exr         R G B A, float: radiance in W/(mm^2 sr) averaged over the pixel (so multiplied with A), A the covered share
///   .png, .tif   8 and 16 bits, sRGB: display = L 2^exposure / white, clipped at 1, over the background; or, transparent,
///                L / A with alpha A
///
/// Errors: kInvalidArgument for another ending.
Result<std::vector<std::byte>> developed(const Image<float>& radiance,
                                         double white,
                                         const render::PictureOptions& picture,
                                         ImageFormat format);

/// The pixels of such a .png.
Image<std::uint8_t> displayed(const Image<float>& radiance,
                              double white,
                              const render::PictureOptions& picture);

/// What is shown as white: picture.white, else the radiance that only half a per cent of the lit pixels exceeds.
double white_of(const Image<float>& radiance, const render::PictureOptions& picture);

}  // namespace opaline::daemon
