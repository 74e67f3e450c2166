#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/image.h"
#include "base/result.h"

/// Image files, to and from memory, so that whoever writes one writes it whole (base/files.h).
/// Threads: all functions may be called from any thread.
namespace opaline {

enum class ImageFormat : std::uint8_t { kPng, kTiff, kExr, kJpeg };  ///< kJpeg: for reading only

/// What an image file holds: pixels, the name of each channel, and text.
///
/// PNG and TIFF take 8- and 16-bit samples and 1, 2, 3 or 4 channels, whose names they do not keep;
/// EXR takes float samples and any number of uniquely named channels, and keeps NaN and infinity.
/// JPEG is read and not written.
/// Samples are stored as they are: no gamma, no colour conversion, alpha not multiplied in.
struct ImageFile {
  std::variant<Image<std::uint8_t>, Image<std::uint16_t>, Image<float>> pixels;
  std::vector<std::string> channels;            ///< empty: Y; Y A; R G B; R G B A, by their count
  std::map<std::string, std::string> metadata;  ///< in TIFF as one JSON object in ImageDescription
};

/// What decode_image() accepts: a file from outside is bounded before its pixels are.
struct ImageLimits {
  std::size_t bytes = std::size_t{1} << 30;   ///< of the file
  std::size_t pixels = std::size_t{1} << 27;  ///< width times height
  int channels = 64;
};

/// The bytes of an image file; the same image gives the same bytes (no dates, no host names),
/// compressed without loss. Errors: kInvalidArgument for an empty image, a sample type that the
/// format does not take, or wrong channel names.
Result<std::vector<std::byte>> encode_image(const ImageFile& image, ImageFormat format);

/// Reads PNG, TIFF (8-, 16-bit, float), DNG (dng.h), EXR (half, float) or JPEG (8-bit), told apart by their first bytes. EXR
/// channels come in the order R G B A, then the others as the file has them: use select_channels()
/// to have them by name. Errors: kInvalidArgument for a truncated, damaged, too large or foreign
/// file, saying which.
Result<ImageFile> decode_image(std::span<const std::byte> bytes, const ImageLimits& limits = {});

/// The named channels of a float image, in that order. Errors: kInvalidArgument naming the one that
/// is missing.
Result<Image<float>> select_channels(const ImageFile& image, std::span<const std::string> names);

/// "frames/x.PNG" -> kPng, by the ending (.png .tif .tiff .exr). Errors: kInvalidArgument for any
/// other.
Result<ImageFormat> image_format_of(std::string_view file_name);

}  // namespace opaline
