#include "base/io/surface_io.h"

#include <fmt/format.h>

#include <array>
#include <sstream>
#include <string>

#include "base/io/image_io.h"

namespace opaline {
namespace {

constexpr std::size_t kFileLimit = std::size_t{1} << 30;
const std::array<std::string, 7> kChannels{
    "R", "G", "B", "variance.R", "variance.G", "variance.B", "mask"};

template <class T>
bool covers(const Image<T>& image, const SurfaceReflectance& s, int channels) {
  return image.width() == s.block.face_width(s.face) &&
         image.height() == s.block.face_height(s.face) && image.channels() == channels;
}

Error damaged(const std::filesystem::path& path, std::string_view what) {
  return invalid_argument(fmt::format("{} is damaged: {}", path.string(), what));
}

std::string entry(const ImageFile& image, const std::string& key) {
  const auto found = image.metadata.find(key);
  return found == image.metadata.end() ? std::string() : found->second;
}

/// Block and face from the metadata; false where they make no sense.
bool read_geometry(const ImageFile& image, SurfaceReflectance& s) {
  std::istringstream cells(entry(image, "opaline_cells"));
  std::istringstream spacing(entry(image, "opaline_spacing_mm"));
  cells >> s.block.nx >> s.block.ny >> s.block.nz;
  spacing >> s.block.hx >> s.block.hy >> s.block.hz;
  if (!cells || !spacing) return false;
  for (const Face face : kFaces) {
    if (to_string(face) != entry(image, "opaline_face")) continue;
    s.face = face;
    return true;
  }
  return false;
}

}  // namespace

Result<void> write_surface(FileOperations& files,
                           const std::filesystem::path& path,
                           const SurfaceReflectance& s) {
  if (!covers(s.reflectance, s, 3) || !covers(s.variance, s, 3) || !covers(s.mask, s, 1))
    return invalid_argument("surface reflectance: a raster does not cover its face");
  Image<float> pixels(s.reflectance.width(), s.reflectance.height(), 7);
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        pixels.at(x, y, c) = s.reflectance.at(x, y, c);
        pixels.at(x, y, 3 + c) = s.variance.at(x, y, c);
      }
      pixels.at(x, y, 6) = s.mask.at(x, y);
    }
  }
  const Block& b = s.block;
  const auto bytes =
      encode_image({std::move(pixels),
                    {kChannels.begin(), kChannels.end()},
                    {{"opaline_format", std::to_string(kSurfaceFormat)},
                     {"opaline_face", std::string(to_string(s.face))},
                     {"opaline_cells", fmt::format("{} {} {}", b.nx, b.ny, b.nz)},
                     {"opaline_spacing_mm", fmt::format("{} {} {}", b.hx, b.hy, b.hz)},
                     {"unit", "1/sr"}}},
                   ImageFormat::kExr);
  if (!bytes) return bytes.error().in(path.string());
  return write_whole(files, path, *bytes);
}

Result<SurfaceReflectance> read_surface(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path, kFileLimit);
  if (!bytes) return bytes.error();
  const auto image = decode_image(*bytes, {.bytes = kFileLimit, .channels = 7});
  if (!image) return image.error().in(path.string());
  const std::string format = entry(*image, "opaline_format");
  if (format != std::to_string(kSurfaceFormat)) {
    return invalid_argument(fmt::format(
        "{}: format \"{}\"; this version reads {}", path.string(), format, kSurfaceFormat));
  }
  SurfaceReflectance s;
  if (!read_geometry(*image, s)) return damaged(path, "its geometry cannot be read");
  const auto pixels = select_channels(*image, kChannels);
  if (!pixels) return pixels.error().in(path.string());
  if (!covers(*pixels, s, 7)) return damaged(path, "its raster does not cover the face it names");
  s.reflectance = Image<float>(pixels->width(), pixels->height(), 3);
  s.variance = s.reflectance;
  s.mask = Image<std::uint8_t>(pixels->width(), pixels->height(), 1);
  for (int y = 0; y < pixels->height(); ++y) {
    for (int x = 0; x < pixels->width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        s.reflectance.at(x, y, c) = pixels->at(x, y, c);
        s.variance.at(x, y, c) = pixels->at(x, y, 3 + c);
      }
      s.mask.at(x, y) = pixels->at(x, y, 6) != 0.0F ? 1 : 0;
    }
  }
  return s;
}

}  // namespace opaline
