#include "base/io/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "base/io/dng.h"

namespace opaline {
namespace {

/// Our pictures are small and our threads have owners: the libraries use the calling thread alone.
void use_calling_thread() {
  static const bool done = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(done);
}

/// Written into every file in place of the time of writing, which would make equal images differ.
constexpr const char* kNoDate = "1970:01:01 00:00:00";

struct FormatName {
  const char* plugin;
  const char* file_name;
  const char* spoken;
};

FormatName name_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::kPng:
      return {"png", "memory.png", "PNG"};
    case ImageFormat::kTiff:
      return {"tiff", "memory.tif", "TIFF"};
    case ImageFormat::kExr:
      return {"openexr", "memory.exr", "EXR"};
    case ImageFormat::kJpeg:
      return {"jpeg", "memory.jpg", "JPEG"};
  }
  return {"openexr", "memory.exr", "EXR"};
}

template <class T>
constexpr OIIO::TypeDesc type_desc() {
  if constexpr (sizeof(T) == 1) return OIIO::TypeDesc::UINT8;
  if constexpr (sizeof(T) == 2) return OIIO::TypeDesc::UINT16;
  return OIIO::TypeDesc::FLOAT;
}

std::vector<std::string> default_channels(int count) {
  switch (count) {
    case 1:
      return {"Y"};
    case 2:
      return {"Y", "A"};
    case 3:
      return {"R", "G", "B"};
    case 4:
      return {"R", "G", "B", "A"};
    default:
      return {};
  }
}

Result<std::vector<std::string>> checked_channels(const ImageFile& image, int count) {
  std::vector<std::string> names =
      image.channels.empty() ? default_channels(count) : image.channels;
  if (names.size() != static_cast<std::size_t>(count)) {
    return invalid_argument(fmt::format("{} channel names for {} channels", names.size(), count));
  }
  if (std::set<std::string>(names.begin(), names.end()).size() != names.size()) {
    return invalid_argument("two channels have the same name");
  }
  return names;
}

template <class T>
Result<void> check_sample_type(ImageFormat format, int channels) {
  const bool is_float = sizeof(T) == 4;
  if (is_float != (format == ImageFormat::kExr)) {
    return invalid_argument(fmt::format("{} does not take {}",
                                        name_of(format).spoken,
                                        is_float ? "float samples" : "integer samples"));
  }
  if (!is_float && channels > 4) {
    return invalid_argument(
        fmt::format("{} takes up to 4 channels, not {}", name_of(format).spoken, channels));
  }
  return ok();
}

void add_metadata(OIIO::ImageSpec& spec,
                  ImageFormat format,
                  const std::map<std::string, std::string>& metadata) {
  if (format != ImageFormat::kPng) spec.attribute("DateTime", kNoDate);
  if (format == ImageFormat::kTiff) {
    if (!metadata.empty()) spec.attribute("ImageDescription", nlohmann::json(metadata).dump());
    return;
  }
  for (const auto& [key, value] : metadata) spec.attribute(key, value);
}

template <class T>
Result<std::vector<std::byte>> encode(const ImageFile& file,
                                      const Image<T>& image,
                                      ImageFormat format) {
  if (image.empty()) return invalid_argument("an empty image cannot be encoded");
  if (auto fits = check_sample_type<T>(format, image.channels()); !fits) return fits.error();
  const auto channels = checked_channels(file, image.channels());
  if (!channels) return channels.error();

  OIIO::ImageSpec spec(image.width(), image.height(), image.channels(), type_desc<T>());
  spec.channelnames = *channels;
  spec.attribute("compression", "zip");
  spec.attribute("oiio:UnassociatedAlpha", 1);
  add_metadata(spec, format, file.metadata);

  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput memory(buffer);
  const auto output = OIIO::ImageOutput::create(name_of(format).plugin);
  if (!output || !output->set_ioproxy(&memory)) {
    return internal_error(
        fmt::format("no {} writer: {}", name_of(format).spoken, OIIO::geterror()));
  }
  if (!output->open(name_of(format).file_name, spec) ||
      !output->write_image(type_desc<T>(), image.samples().data()) || !output->close()) {
    return internal_error(fmt::format("{}: {}", name_of(format).spoken, output->geterror()));
  }
  const auto* first = reinterpret_cast<const std::byte*>(buffer.data());
  return std::vector<std::byte>(first, first + buffer.size());
}

bool starts_with(std::span<const std::byte> bytes, std::string_view magic) {
  return bytes.size() >= magic.size() &&
         std::equal(magic.begin(), magic.end(), bytes.begin(), [](char a, std::byte b) {
           return static_cast<std::byte>(a) == b;
         });
}

std::optional<ImageFormat> detect(std::span<const std::byte> bytes) {
  using namespace std::string_view_literals;
  if (starts_with(bytes, "\x89PNG\r\n\x1a\n"sv)) return ImageFormat::kPng;
  if (starts_with(bytes, "II*\0"sv) || starts_with(bytes, "MM\0*"sv)) return ImageFormat::kTiff;
  if (starts_with(bytes, "\x76\x2f\x31\x01"sv)) return ImageFormat::kExr;
  if (starts_with(bytes, "\xff\xd8\xff"sv)) return ImageFormat::kJpeg;
  return std::nullopt;
}

Result<void> check_limits(const OIIO::ImageSpec& spec, const ImageLimits& limits) {
  const bool sane = spec.width > 0 && spec.height > 0 && spec.depth <= 1 && spec.nchannels > 0;
  if (!sane) return invalid_argument("no flat picture in the file");
  if (static_cast<std::size_t>(spec.width) >
      limits.pixels / static_cast<std::size_t>(spec.height)) {
    return invalid_argument(fmt::format(
        "{} x {} pixels; expected at most {} in all", spec.width, spec.height, limits.pixels));
  }
  if (spec.nchannels > limits.channels) {
    return invalid_argument(
        fmt::format("{} channels; expected at most {}", spec.nchannels, limits.channels));
  }
  return ok();
}

std::map<std::string, std::string> read_metadata(const OIIO::ImageSpec& spec, ImageFormat format) {
  std::map<std::string, std::string> metadata;
  if (format == ImageFormat::kTiff) {
    const auto text = std::string(spec.get_string_attribute("ImageDescription"));
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return metadata;
    for (const auto& [key, value] : json.items()) {
      if (value.is_string()) metadata[key] = value.get<std::string>();
    }
    return metadata;
  }
  const std::set<std::string> not_ours{"DateTime", "compression"};
  for (const auto& attribute : spec.extra_attribs) {
    const std::string name = attribute.name().string();
    const bool text = attribute.type() == OIIO::TypeDesc::STRING;
    if (text && !not_ours.contains(name) && !name.starts_with("oiio:")) {
      metadata[name] = attribute.get_string();
    }
  }
  return metadata;
}

template <class T>
Result<ImageFile> read_pixels(OIIO::ImageInput& input,
                              const OIIO::ImageSpec& spec,
                              ImageFormat format) {
  Image<T> pixels(spec.width, spec.height, spec.nchannels);
  if (!input.read_image(0, 0, 0, spec.nchannels, type_desc<T>(), pixels.samples().data())) {
    return invalid_argument(
        fmt::format("damaged or truncated {}: {}", name_of(format).spoken, input.geterror()));
  }
  return ImageFile{std::move(pixels), spec.channelnames, read_metadata(spec, format)};
}

Result<ImageFile> decode(std::span<const std::byte> bytes,
                         ImageFormat format,
                         const ImageLimits& limits) {
  OIIO::Filesystem::IOMemReader memory(bytes.data(), bytes.size());
  const auto input = OIIO::ImageInput::create(name_of(format).plugin);
  if (!input || !input->set_ioproxy(&memory)) {
    return internal_error(
        fmt::format("no {} reader: {}", name_of(format).spoken, OIIO::geterror()));
  }
  OIIO::ImageSpec spec;
  OIIO::ImageSpec wishes;
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  if (!input->open(name_of(format).file_name, spec, wishes)) {
    return invalid_argument(
        fmt::format("damaged or truncated {}: {}", name_of(format).spoken, input->geterror()));
  }
  if (auto within = check_limits(spec, limits); !within) return within.error();
  switch (spec.format.basetype) {
    case OIIO::TypeDesc::UINT8:
      return read_pixels<std::uint8_t>(*input, spec, format);
    case OIIO::TypeDesc::UINT16:
      return read_pixels<std::uint16_t>(*input, spec, format);
    case OIIO::TypeDesc::HALF:
    case OIIO::TypeDesc::FLOAT:
      return read_pixels<float>(*input, spec, format);
    default:
      return invalid_argument(fmt::format("samples of type {}", spec.format.c_str()));
  }
}

Result<ImageFile> decode_dng(std::span<const std::byte> bytes, const ImageLimits& limits) {
  const auto picture = read_dng_picture(bytes);
  if (!picture) return picture.error();
  if (picture->mosaic) return decode_dng_mosaic(bytes, *picture, limits);
  if (picture->first) return decode(bytes, ImageFormat::kTiff, limits);
  return invalid_argument(
      "this DNG's picture of all three colours (LinearRaw) is behind a smaller one: convert it to "
      "a "
      "16-bit TIFF without gamma");
}

}  // namespace

Result<std::vector<std::byte>> encode_image(const ImageFile& image, ImageFormat format) {
  if (format == ImageFormat::kJpeg) return invalid_argument("JPEG is read only: it loses");
  try {
    use_calling_thread();
    return std::visit([&](const auto& pixels) { return encode(image, pixels, format); },
                      image.pixels);
  } catch (const std::exception& failure) {
    return internal_error(fmt::format("{}: {}", name_of(format).spoken, failure.what()));
  }
}

Result<ImageFile> decode_image(std::span<const std::byte> bytes, const ImageLimits& limits) {
  if (bytes.size() > limits.bytes) {
    return invalid_argument(
        fmt::format("{} bytes; expected at most {}", bytes.size(), limits.bytes));
  }
  const std::optional<ImageFormat> format = detect(bytes);
  if (!format) return invalid_argument("not a PNG, TIFF, DNG, EXR or JPEG file");
  try {
    use_calling_thread();
    if (*format == ImageFormat::kTiff && is_dng(bytes)) return decode_dng(bytes, limits);
    return decode(bytes, *format, limits);
  } catch (const std::exception& failure) {
    return invalid_argument(fmt::format("{}: {}", name_of(*format).spoken, failure.what()));
  }
}

Result<Image<float>> select_channels(const ImageFile& image, std::span<const std::string> names) {
  const auto* pixels = std::get_if<Image<float>>(&image.pixels);
  if (pixels == nullptr) return invalid_argument("expected float samples");
  if (names.empty()) return invalid_argument("no channel asked for");
  Image<float> selected(pixels->width(), pixels->height(), static_cast<int>(names.size()));
  for (std::size_t c = 0; c < names.size(); ++c) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), names[c]);
    if (found == image.channels.end()) {
      return invalid_argument(fmt::format("no channel \"{}\" in the image", names[c]));
    }
    const auto from = static_cast<std::size_t>(found - image.channels.begin());
    const auto stride = static_cast<std::size_t>(pixels->channels());
    for (std::size_t i = 0; i < pixels->pixel_count(); ++i) {
      selected.samples()[i * names.size() + c] = pixels->samples()[i * stride + from];
    }
  }
  return selected;
}

Result<ImageFormat> image_format_of(std::string_view file_name) {
  const std::size_t dot = file_name.rfind('.');
  std::string ending(dot == std::string_view::npos ? "" : file_name.substr(dot));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  if (ending == ".png") return ImageFormat::kPng;
  if (ending == ".tif" || ending == ".tiff") return ImageFormat::kTiff;
  if (ending == ".exr") return ImageFormat::kExr;
  return invalid_argument(
      fmt::format("\"{}\": expected a name ending in .png, .tif, .tiff or .exr", file_name));
}

}  // namespace opaline
