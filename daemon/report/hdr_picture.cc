#include "daemon/report/hdr_picture.h"

#include <array>
#include <string>

#include "base/files.h"
#include "base/io/image_io.h"

namespace opaline::daemon {
namespace {

Image<std::uint8_t> flags(const Image<float>& pixels, int channel) {
  Image<std::uint8_t> set(pixels.width(), pixels.height(), 1);
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) set.at(x, y) = pixels.at(x, y, channel) > 0.5F ? 1 : 0;
  }
  return set;
}

Image<float> colors(const Image<float>& pixels, int first) {
  Image<float> rgb(pixels.width(), pixels.height(), 3);
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) {
      for (int c = 0; c < 3; ++c) rgb.at(x, y, c) = pixels.at(x, y, first + c);
    }
  }
  return rgb;
}

}  // namespace

Result<HdrPicture> read_hdr_picture(const std::filesystem::path& path) {
  static const std::array<std::string, 8> kChannels{
      "R", "G", "B", "var.R", "var.G", "var.B", "mask", "saturated"};
  const auto bytes = read_bytes(path, std::size_t{4} << 30);
  if (!bytes) return bytes.error();
  const auto file = decode_image(*bytes);
  if (!file) return file.error().in(path.string());
  const auto pixels = select_channels(*file, kChannels);
  if (!pixels) return pixels.error().in(path.string());
  return HdrPicture{colors(*pixels, 0), colors(*pixels, 3), flags(*pixels, 6), flags(*pixels, 7)};
}

}  // namespace opaline::daemon
