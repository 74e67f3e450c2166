#include "capture/hdr_file.h"

#include <algorithm>
#include <array>
#include <string>

#include "base/io/image_io.h"

namespace opaline::capture {
namespace {

const std::array<std::string, 8> kChannels{
    "R", "G", "B", "var.R", "var.G", "var.B", "mask", "saturated"};
constexpr std::size_t kLimit = std::size_t{4} << 30;

}  // namespace

Result<std::vector<std::byte>> encode_hdr(const HdrImage& hdr) {
  const int width = hdr.radiance.width();
  const int height = hdr.radiance.height();
  Image<float> pixels(width, height, static_cast<int>(kChannels.size()));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        pixels.at(x, y, c) = hdr.radiance.at(x, y, c);
        pixels.at(x, y, 3 + c) = hdr.variance.at(x, y, c);
      }
      pixels.at(x, y, 6) = hdr.mask.at(x, y);
      pixels.at(x, y, 7) = hdr.saturated.at(x, y);
    }
  }
  return encode_image(
      {std::move(pixels), {kChannels.begin(), kChannels.end()}, {{"unit", "W/(mm^2 sr)"}}},
      ImageFormat::kExr);
}

Result<HdrImage> read_hdr(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path, kLimit);
  if (!bytes) return bytes.error();
  const auto file = decode_image(*bytes);
  if (!file) return file.error().in(path.string());
  const auto pixels = select_channels(*file, kChannels);
  if (!pixels) return pixels.error().in(path.string());
  const int width = pixels->width();
  const int height = pixels->height();
  HdrImage hdr{Image<float>(width, height, 3),
               Image<float>(width, height, 3),
               Image<std::uint8_t>(width, height, 1),
               Image<std::uint8_t>(width, height, 1)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        hdr.radiance.at(x, y, c) = pixels->at(x, y, c);
        hdr.variance.at(x, y, c) = pixels->at(x, y, 3 + c);
      }
      hdr.mask.at(x, y) = pixels->at(x, y, 6) > 0.5F ? 1 : 0;
      hdr.saturated.at(x, y) = pixels->at(x, y, 7) > 0.5F ? 1 : 0;
    }
  }
  return hdr;
}

Result<void> write_hdr(FileOperations& files,
                       const std::filesystem::path& path,
                       const HdrImage& hdr) {
  const auto bytes = encode_hdr(hdr);
  if (!bytes) return bytes.error().in(path.string());
  const auto present = read_bytes(path, bytes->size());
  if (present && std::ranges::equal(*present, *bytes)) return ok();
  return write_whole(files, path, *bytes);
}

}  // namespace opaline::capture
