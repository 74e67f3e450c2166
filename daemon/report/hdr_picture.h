#pragma once

#include <cstdint>
#include <filesystem>

#include "base/image.h"
#include "base/result.h"

namespace opaline::daemon {

/// One light as the camera saw it: hdr/NAME.exr of a session, camera pixels.
struct HdrPicture {
  Image<float> radiance;          ///< 3 channels, W/(mm^2 sr)
  Image<float> variance;          ///< of it
  Image<std::uint8_t> usable;     ///< 1: neither saturated nor hot
  Image<std::uint8_t> saturated;  ///< 1: clipped even in the shortest exposure
};

/// Errors: kNotFound; kInvalidArgument for a damaged file or one without these channels.
Result<HdrPicture> read_hdr_picture(const std::filesystem::path& path);

}  // namespace opaline::daemon
