#include "base/io/dng.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

#include "base/file_descriptor.h"

namespace opaline {
namespace {

// Tags of TIFF 6.0 and DNG 1.4.
enum Tag : std::uint16_t {
  kWidth = 256,
  kHeight = 257,
  kBits = 258,
  kPhotometric = 262,
  kStripOffsets = 273,
  kSamples = 277,
  kStripBytes = 279,
  kTileOffsets = 324,
  kTileBytes = 325,
  kSubDirectories = 330,
  kSampleFormat = 339,
  kPatternSize = 33421,
  kPattern = 33422,
  kDngVersion = 50706,
  kPlaneColors = 50710,
  kBlackLevel = 50714,
  kWhiteLevel = 50717,
  kActiveArea = 50829,
};
constexpr double kMosaic = 32803.0;
constexpr double kLinearRaw = 34892.0;
constexpr std::size_t kMostEntries = 1024;
constexpr std::size_t kMostValues = 65536;
constexpr std::size_t kMostDirectories = 64;

/// Numbers in a TIFF, of either byte order; none beyond its end.
class TiffReader {
 public:
  using Directory = std::map<std::uint16_t, std::vector<double>>;

  explicit TiffReader(std::span<const std::byte> bytes)
      : bytes_(bytes), big_endian_(!bytes.empty() && bytes[0] == std::byte{'M'}) {}

  /// Every directory, the first one first: the chain, and what hangs from each of it.
  std::optional<std::vector<Directory>> directories() const {
    std::vector<Directory> found;
    std::vector<std::size_t> to_read;
    const auto first = number(4, 4);
    if (!first) return std::nullopt;
    to_read.push_back(static_cast<std::size_t>(*first));
    for (std::size_t i = 0; i < to_read.size(); ++i) {
      if (to_read.size() > kMostDirectories) return std::nullopt;
      std::size_t next = 0;
      auto directory = directory_at(to_read[i], next);
      if (!directory) return std::nullopt;
      if (next != 0) to_read.push_back(next);
      if (const auto sub = directory->find(kSubDirectories); sub != directory->end()) {
        for (const double offset : sub->second) to_read.push_back(static_cast<std::size_t>(offset));
      }
      found.push_back(*std::move(directory));
    }
    return found;
  }
  std::optional<Directory> first_directory() const {
    const auto first = number(4, 4);
    std::size_t next = 0;
    return first ? directory_at(static_cast<std::size_t>(*first), next) : std::nullopt;
  }

 private:
  std::optional<std::uint32_t> number(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t at = big_endian_ ? offset + i : offset + size - 1 - i;
      value = value << 8U | std::to_integer<std::uint32_t>(bytes_[at]);
    }
    return value;
  }
  std::optional<Directory> directory_at(std::size_t offset, std::size_t& next) const {
    const auto count = number(offset, 2);
    if (!count || *count > kMostEntries) return std::nullopt;
    Directory directory;
    for (std::size_t i = 0; i < *count; ++i) {
      const std::size_t entry = offset + 2 + 12 * i;
      const auto tag = number(entry, 2);
      const auto type = number(entry + 2, 2);
      const auto values = number(entry + 4, 4);
      if (!tag || !type || !values || !number(entry + 8, 4)) return std::nullopt;
      directory[static_cast<std::uint16_t>(*tag)] = values_at(entry + 8, *type, *values);
    }
    const auto after = number(offset + 2 + 12 * static_cast<std::size_t>(*count), 4);
    if (!after) return std::nullopt;
    next = *after;
    return directory;
  }
  /// The first of an entry's values, as far as they are there; none of a type that no tag of ours has.
  std::vector<double> values_at(std::size_t field, std::uint32_t type, std::size_t count) const {
    const std::size_t size = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : type == 5 ? 8 : 0;
    std::vector<double> values;
    if (size == 0) return values;
    const std::size_t at = count * size <= 4 ? field : number(field, 4).value_or(0);
    for (std::size_t i = 0; i < std::min(count, kMostValues); ++i) {
      const std::size_t place = at + i * size;
      const auto value = number(place, std::min<std::size_t>(size, 4));
      const auto below = size == 8 ? number(place + 4, 4) : std::optional<std::uint32_t>(1);
      if (!value || !below || *below == 0) break;
      values.push_back(static_cast<double>(*value) / static_cast<double>(*below));
    }
    return values;
  }

  std::span<const std::byte> bytes_;
  bool big_endian_;
};

double value_of(const TiffReader::Directory& directory, Tag tag, double otherwise) {
  const auto found = directory.find(tag);
  return found == directory.end() || found->second.empty() ? otherwise : found->second.front();
}
std::vector<double> values_of(const TiffReader::Directory& directory, Tag tag) {
  const auto found = directory.find(tag);
  return found == directory.end() ? std::vector<double>{} : found->second;
}

double pixels_of(const TiffReader::Directory& directory) {
  return value_of(directory, kWidth, 0.0) * value_of(directory, kHeight, 0.0);
}

bool is_raw(const TiffReader::Directory& directory) {
  const double kind = value_of(directory, kPhotometric, 0.0);
  return kind == kMosaic || kind == kLinearRaw;
}

/// Whether all of its pixels' bytes are in the file: LibRaw would make up what is missing.
bool is_whole(const TiffReader::Directory& directory, std::size_t file_bytes) {
  const auto within = [&](Tag offsets, Tag bytes) {
    const std::vector<double> first = values_of(directory, offsets);
    const std::vector<double> count = values_of(directory, bytes);
    if (first.empty() || first.size() != count.size()) return false;
    for (std::size_t i = 0; i < first.size(); ++i)
      if (first[i] + count[i] > static_cast<double>(file_bytes)) return false;
    return true;
  };
  return within(kStripOffsets, kStripBytes) || within(kTileOffsets, kTileBytes);
}

/// The colours of 2 x 2 pixels; none where they are no Bayer pattern.
std::optional<std::array<std::uint8_t, 4>> colors_of(const TiffReader::Directory& directory) {
  const std::vector<double> pattern = values_of(directory, kPattern);
  const std::vector<double> planes = values_of(directory, kPlaneColors);
  const bool usual = planes.empty() || planes == std::vector<double>{0.0, 1.0, 2.0};
  if (values_of(directory, kPatternSize) != std::vector<double>{2.0, 2.0} || pattern.size() != 4 ||
      !usual)
    return std::nullopt;
  std::array<std::uint8_t, 4> colors{};
  std::array<int, 3> count{};
  for (std::size_t i = 0; i < 4; ++i) {
    if (pattern[i] > 2.0) return std::nullopt;
    colors[i] = static_cast<std::uint8_t>(pattern[i]);
    ++count[colors[i]];
  }
  return count == std::array{1, 2, 1} ? std::optional(colors) : std::nullopt;
}

Result<DngPicture> picture_in(const TiffReader::Directory& directory) {
  DngPicture picture;
  picture.mosaic = value_of(directory, kPhotometric, 0.0) == kMosaic;
  const double width = value_of(directory, kWidth, 0.0);
  const double height = value_of(directory, kHeight, 0.0);
  std::vector<double> area = values_of(directory, kActiveArea);  // top, left, bottom, right
  if (area.size() != 4) area = {0.0, 0.0, height, width};
  const bool sane = width >= 2.0 && height >= 2.0 && width < 65536.0 && height < 65536.0 &&
                    area[0] + 2.0 <= area[2] && area[2] <= height && area[1] + 2.0 <= area[3] &&
                    area[3] <= width;
  if (!sane) return invalid_argument("damaged DNG: its picture's size makes no sense");
  picture.width = static_cast<int>(area[3] - area[1]);
  picture.height = static_cast<int>(area[2] - area[0]);
  picture.black_level = value_of(directory, kBlackLevel, 0.0);
  const double bits = value_of(directory, kBits, 0.0);
  picture.white_level = value_of(directory, kWhiteLevel, std::exp2(bits) - 1.0);
  if (!picture.mosaic) return picture;
  const auto colors = colors_of(directory);
  const bool whole = value_of(directory, kSampleFormat, 1.0) == 1.0 && bits >= 8.0 &&
                     bits <= 16.0 && value_of(directory, kSamples, 1.0) == 1.0;
  if (!colors || !whole)
    return invalid_argument(fmt::format(
        "this DNG's picture is no mosaic of red, green, green and blue in whole codes of 8 to 16 "
        "bits: convert it to a 16-bit TIFF without gamma"));
  picture.colors = *colors;
  return picture;
}

Result<FileDescriptor> file_in_memory(std::span<const std::byte> bytes) {
  FileDescriptor file(::memfd_create("dng", MFD_CLOEXEC));
  if (file.get() < 0)
    return unavailable(fmt::format("no file in memory: {}", std::strerror(errno)));
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      return unavailable(fmt::format("no room for a file in memory: {}", std::strerror(errno)));
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return file;
}

Result<Image<std::uint16_t>> unpack(std::span<const std::byte> dng, const DngPicture& picture) {
  const auto input = OIIO::ImageInput::create("raw");
  if (!input)
    return unavailable(fmt::format(
        "this OpenImageIO reads no DNG: it is built without LibRaw (\"{}\"). Install one that is, "
        "or convert the photograph to a 16-bit TIFF without gamma (dcraw -D -4 -T leaves its "
        "mosaic)",
        OIIO::geterror()));
  const auto file = file_in_memory(dng);
  if (!file) return file.error();
  OIIO::ImageSpec spec;
  OIIO::ImageSpec wishes;
  wishes.attribute("raw:Demosaic", "none");
  wishes.attribute("raw:user_flip", 0);
  if (!input->open(fmt::format("/proc/self/fd/{}", file->get()), spec, wishes))
    return invalid_argument(fmt::format("damaged or truncated DNG: {}", input->geterror()));
  if (spec.width != picture.width || spec.height != picture.height || spec.nchannels != 1)
    return invalid_argument(
        fmt::format("DNG: LibRaw finds {} x {} pixels of {} channels, its tags say {} x {} of one",
                    spec.width,
                    spec.height,
                    spec.nchannels,
                    picture.width,
                    picture.height));
  Image<std::uint16_t> codes(spec.width, spec.height, 1);
  if (!input->read_image(0, 0, 0, 1, OIIO::TypeDesc::UINT16, codes.samples().data()))
    return invalid_argument(fmt::format("damaged or truncated DNG: {}", input->geterror()));
  return codes;
}

Image<std::uint16_t> binned(const Image<std::uint16_t>& mosaic, const DngPicture& picture) {
  Image<std::uint16_t> colors(mosaic.width() / 2, mosaic.height() / 2, 3);
  for (int y = 0; y < colors.height(); ++y) {
    for (int x = 0; x < colors.width(); ++x) {
      std::array<int, 2> greens{};
      std::size_t green = 0;
      for (int i = 0; i < 4; ++i) {
        const std::uint8_t color = picture.colors[static_cast<std::size_t>(i)];
        const std::uint16_t code = mosaic.at(2 * x + i % 2, 2 * y + i / 2);
        if (color == 1) {
          greens[green++] = code;
        } else {
          colors.at(x, y, color) = code;
        }
      }
      const int most = std::max(greens[0], greens[1]);
      const int mean = (greens[0] + greens[1] + 1) / 2;
      colors.at(x, y, 1) = static_cast<std::uint16_t>(most >= picture.white_level ? most : mean);
    }
  }
  return colors;
}

}  // namespace

bool is_dng(std::span<const std::byte> tiff) {
  const auto directory = TiffReader(tiff).first_directory();
  return directory && directory->contains(kDngVersion);
}

Result<DngPicture> read_dng_picture(std::span<const std::byte> tiff) {
  const auto directories = TiffReader(tiff).directories();
  if (!directories) return invalid_argument("damaged or truncated DNG: its tags");
  const auto largest = std::ranges::max_element(*directories, {}, pixels_of);
  // LibRaw takes the largest, whatever it is.
  const auto as_large = std::ranges::count_if(
      *directories, [&](const auto& d) { return pixels_of(d) == pixels_of(*largest); });
  if (!is_raw(*largest) || as_large > 1)
    return invalid_argument("this DNG's largest picture is not the sensor's: convert it to a TIFF");
  if (!is_whole(*largest, tiff.size()))
    return invalid_argument("damaged or truncated DNG: pixels are missing");
  auto picture = picture_in(*largest);
  if (picture) picture->first = largest == directories->begin();
  return picture;
}

Result<ImageFile> decode_dng_mosaic(std::span<const std::byte> dng,
                                    const DngPicture& picture,
                                    const ImageLimits& limits) {
  if (static_cast<std::size_t>(picture.width) >
      limits.pixels / static_cast<std::size_t>(picture.height))
    return invalid_argument(fmt::format("{} x {} pixels; expected at most {} in all",
                                        picture.width,
                                        picture.height,
                                        limits.pixels));
  if (limits.channels < 3)
    return invalid_argument(fmt::format("3 channels; expected at most {}", limits.channels));
  auto mosaic = unpack(dng, picture);
  if (!mosaic) return mosaic.error();
  return ImageFile{binned(*mosaic, picture),
                   {"R", "G", "B"},
                   {{"black_level", fmt::format("{}", picture.black_level)},
                    {"white_level", fmt::format("{}", picture.white_level)}}};
}

}  // namespace opaline
