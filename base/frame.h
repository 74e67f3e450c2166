#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "base/image.h"

namespace opaline {

/// One exposure as a camera delivers it, with what proves which pattern it shows.
struct Frame {
  Image<std::uint16_t> pixels;  ///< 3 channels, raw codes, black level included
  int bit_depth = 12;           ///< codes run from 0 to 2^bit_depth - 1
  std::uint64_t pattern_id =
      0;  ///< of the pattern shown during the whole exposure; 0 = none or more than one
  std::uint64_t trigger_count = 0;      ///< the camera's own count of exposures since it was opened
  std::chrono::nanoseconds start{};     ///< of the exposure, on the rig's monotonic clock
  std::chrono::nanoseconds exposure{};  ///< as measured by the camera, not as asked for
  std::string sha256;  ///< of the pixels as sent by the camera, lower-case hex: see frame_hash()
};

/// SHA-256 over width, height, channels (32-bit little endian) and the samples (16-bit little
/// endian), lower-case hex.
std::string frame_hash(const Image<std::uint16_t>& pixels);

}  // namespace opaline
