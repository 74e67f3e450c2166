#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/io/image_io.h"
#include "base/result.h"

namespace opaline {

/// The largest picture of a DNG (Adobe's specification 1.4), as its tags have it: the sensor's own, not one of the smaller ones to look at.
struct DngPicture {
  int width = 0;  ///< of the sensor's active area
  int height = 0;
  bool mosaic = true;  ///< one colour a pixel; else all three (LinearRaw)
  bool first = true;   ///< in the file's first directory, where a reader of TIFF finds it
  std::array<std::uint8_t, 4> colors{};  ///< of 2 x 2 pixels, row by row: 0 red, 1 green, 2 blue
  double black_level = 0.0;              ///< code; of the first where there are more
  double white_level = 0.0;
};

/// Whether a TIFF says in its first directory that it is a DNG.
bool is_dng(std::span<const std::byte> tiff);

/// Errors: kInvalidArgument for damaged tags, and for pictures that are neither a mosaic of 2 x 2 pixels, red, green twice, blue, nor LinearRaw.
Result<DngPicture> read_dng_picture(std::span<const std::byte> tiff);

/// A mosaic as a picture of half as many columns and rows, R G B: each 2 x 2 pixels are one, green the mean of two, or the highest code where
/// one of them has it, so that nothing is interpolated and clipped stays clipped. Codes as the sensor gave them, after the file's own
/// compression and linearisation table: no black subtracted (it is in the metadata, "black_level", with "white_level"), no white balance, no
/// gamma, no brightening, not turned. Unpacked by OpenImageIO's `raw` plug-in, that is LibRaw, from a file in memory.
///
/// Errors: kInvalidArgument for a damaged or too large picture; kUnavailable, with the remedy, where OpenImageIO is built without the plug-in.
Result<ImageFile> decode_dng_mosaic(std::span<const std::byte> dng,
                                    const DngPicture& picture,
                                    const ImageLimits& limits);

}  // namespace opaline
