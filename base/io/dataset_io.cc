#include "base/io/dataset_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "base/format_version.h"
#include "base/io/image_io.h"
#include "base/sha256.h"

namespace opaline {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kSeenFile = "dataset.exr";
constexpr const char* kLightFile = "dataset_light.exr";
constexpr const char* kSidecar = "dataset.json";
constexpr int kMaxIlluminations = 4096;
constexpr int kSeenChannels = 7;   // of one illumination: radiance, variance, mask
constexpr int kLightChannels = 3;  // irradiance
constexpr int kDirectionChannels = 2;

std::array<std::string, kDirectionChannels> direction_channels() {
  return {"view_direction.column", "view_direction.row"};
}
constexpr std::size_t kFileLimit = std::size_t{4} << 30;

std::vector<std::string> rgb(const std::string& prefix) {
  return {prefix + ".R", prefix + ".G", prefix + ".B"};
}

std::vector<std::string> seen_channels(const std::string& name) {
  std::vector<std::string> names = rgb(name + ".radiance");
  for (std::string& variance : rgb(name + ".variance")) names.push_back(std::move(variance));
  names.push_back(name + ".mask");
  return names;
}

template <class From>
void copy_in(Image<float>& to, int channel, const Image<From>& from) {
  for (int y = 0; y < to.height(); ++y) {
    for (int x = 0; x < to.width(); ++x) {
      for (int c = 0; c < from.channels(); ++c) {
        to.at(x, y, channel + c) = static_cast<float>(from.at(x, y, c));
      }
    }
  }
}

template <class To>
void copy_out(const Image<float>& from, int channel, Image<To>& to) {
  for (int y = 0; y < to.height(); ++y) {
    for (int x = 0; x < to.width(); ++x) {
      for (int c = 0; c < to.channels(); ++c) {
        to.at(x, y, c) = static_cast<To>(from.at(x, y, channel + c));
      }
    }
  }
}

template <class T>
bool fits(const Image<T>& image, const Block& block, Face face, int channels) {
  return image.width() == block.face_width(face) && image.height() == block.face_height(face) &&
         image.channels() == channels;
}

bool valid_name(const std::string& name) {
  return !name.empty() &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
}

/// As the files hold them: the illuminations, the uniform one last.
std::vector<const Illumination*> lights_of(const Dataset& set) {
  std::vector<const Illumination*> lights;
  for (const Illumination& light : set.illuminations) lights.push_back(&light);
  if (set.uniform) lights.push_back(&*set.uniform);
  return lights;
}

Result<void> check(const Dataset& set) {
  if (!fits(set.view_cosine, set.block, set.seen_face, 1)) {
    return invalid_argument("dataset: view_cosine does not fit the seen face");
  }
  if (!set.view_direction.samples().empty() &&
      !fits(set.view_direction, set.block, set.seen_face, kDirectionChannels)) {
    return invalid_argument("dataset: view_direction does not fit the seen face");
  }
  std::set<std::string> names;
  for (const Illumination* light : lights_of(set)) {
    if (!valid_name(light->name) || !names.insert(light->name).second) {
      return invalid_argument(fmt::format(
          "dataset: illumination \"{}\": expected names of a-z 0-9 _ -, each once", light->name));
    }
    if (!fits(light->irradiance, set.block, set.lit_face, kColorChannels) ||
        !fits(light->radiance, set.block, set.seen_face, kColorChannels) ||
        !fits(light->radiance_variance, set.block, set.seen_face, kColorChannels) ||
        !fits(light->mask, set.block, set.seen_face, 1)) {
      return invalid_argument(
          fmt::format("dataset: a raster of {} does not fit its face", light->name));
    }
  }
  return ok();
}

ImageFile seen_image(const Dataset& set) {
  const auto lights = lights_of(set);
  const int count = static_cast<int>(lights.size());
  const bool directed = !set.view_direction.samples().empty();
  const int before = directed ? 1 + kDirectionChannels : 1;
  Image<float> pixels(
      set.view_cosine.width(), set.view_cosine.height(), before + kSeenChannels * count);
  std::vector<std::string> channels{"view_cosine"};
  copy_in(pixels, 0, set.view_cosine);
  if (directed) {
    for (const std::string& name : direction_channels()) channels.push_back(name);
    copy_in(pixels, 1, set.view_direction);
  }
  for (int i = 0; i < count; ++i) {
    const Illumination& light = *lights[static_cast<std::size_t>(i)];
    const int first = before + kSeenChannels * i;
    copy_in(pixels, first, light.radiance);
    copy_in(pixels, first + 3, light.radiance_variance);
    copy_in(pixels, first + 6, light.mask);
    for (std::string& name : seen_channels(light.name)) channels.push_back(std::move(name));
  }
  return {std::move(pixels), std::move(channels), {}};
}

// With no illumination at all the raster is one channel of zeros, since an EXR cannot be empty.
ImageFile light_image(const Dataset& set) {
  const auto lights = lights_of(set);
  const int count = static_cast<int>(lights.size());
  Image<float> pixels(set.block.face_width(set.lit_face),
                      set.block.face_height(set.lit_face),
                      std::max(1, kLightChannels * count));
  std::vector<std::string> channels;
  for (int i = 0; i < count; ++i) {
    const Illumination& light = *lights[static_cast<std::size_t>(i)];
    copy_in(pixels, kLightChannels * i, light.irradiance);
    for (std::string& name : rgb(light.name + ".irradiance")) channels.push_back(std::move(name));
  }
  if (channels.empty()) channels.emplace_back("none");
  return {std::move(pixels), std::move(channels), {}};
}

Result<std::string> write_image(FileOperations& files,
                                const fs::path& path,
                                const ImageFile& image) {
  const auto bytes = encode_image(image, ImageFormat::kExr);
  if (!bytes) return bytes.error().in(path.string());
  if (auto written = write_whole(files, path, *bytes); !written) return written.error();
  return sha256_hex(*bytes);
}

json describe(const Dataset& set) {
  json lights = json::array();
  for (const Illumination* light : lights_of(set)) {
    lights.push_back({{"name", light->name}, {"held_out", light->held_out}});
    if (light->calibration_share > 0.0)
      lights.back()["calibration_share"] = light->calibration_share;
  }
  if (set.uniform) lights.back()["uniform"] = true;
  return {{"format", kDatasetFormat},
          {"cells", set.block.cells()},
          {"spacing_mm", set.block.spacing()},
          {"ior", set.ior},
          {"lit_face", to_string(set.lit_face)},
          {"seen_face", to_string(set.seen_face)},
          {"illuminations", std::move(lights)}};
}

Error damaged(const fs::path& path, std::string_view what) {
  return invalid_argument(
      fmt::format("{} is damaged: {}; delete it and start the session again", path.string(), what));
}

Result<Face> face_named(const std::string& name) {
  for (const Face face : kFaces) {
    if (to_string(face) == name) return face;
  }
  return invalid_argument(fmt::format("no face is called \"{}\"", name));
}

Result<json> read_sidecar(const fs::path& path) {
  const auto text = read_text(path);
  if (!text) return text.error();
  json sidecar = json::parse(*text, nullptr, false);
  if (!sidecar.is_object()) return damaged(path, "it is not JSON");
  const auto format = format_of(sidecar);
  if (!format) return damaged(path, "no format");
  if (*format > kDatasetFormat) return newer_format(path, *format, kDatasetFormat);
  return sidecar;
}

// Throws nlohmann's exceptions on missing or wrong members; the caller turns them into an Error.
Result<Dataset> header_from(const json& sidecar) {
  Dataset set;
  const auto cells = sidecar.at("cells").get<std::array<int, 3>>();
  const auto spacing = sidecar.at("spacing_mm").get<std::array<double, 3>>();
  set.block = {cells[0], cells[1], cells[2], spacing[0], spacing[1], spacing[2]};
  set.ior = sidecar.at("ior").get<double>();
  const auto lit = face_named(sidecar.at("lit_face").get<std::string>());
  const auto seen = face_named(sidecar.at("seen_face").get<std::string>());
  if (!lit) return lit.error();
  if (!seen) return seen.error();
  set.lit_face = *lit;
  set.seen_face = *seen;
  for (const json& light : sidecar.at("illuminations")) {
    Illumination& added = set.illuminations.emplace_back();
    added.name = light.at("name").get<std::string>();
    added.held_out = light.at("held_out").get<bool>();
    added.calibration_share = std::clamp(light.value("calibration_share", 0.0), 0.0, 1.0);
  }
  if (!set.illuminations.empty() && sidecar.at("illuminations").back().value("uniform", false)) {
    set.uniform = std::move(set.illuminations.back());
    set.illuminations.pop_back();
  }
  const bool sane = *std::ranges::min_element(cells) > 0 && *std::ranges::min_element(spacing) > 0;
  if (!sane) return invalid_argument("cells and spacing are not > 0");
  if (set.illuminations.size() > kMaxIlluminations) return invalid_argument("too many lights");
  return set;
}

Result<Dataset> parse_header(const fs::path& path, const json& sidecar) {
  try {
    auto header = header_from(sidecar);
    if (!header) return damaged(path, header.error().message);
    return header;
  } catch (const json::exception& e) {
    return damaged(path, e.what());
  }
}

Result<ImageFile> read_image(const fs::path& path, const json& sidecar, int channels) {
  const auto bytes = read_bytes(path, kFileLimit);
  if (!bytes) return bytes.error();
  const json expected = sidecar.value("sha256", json::object()).value(path.filename().string(), "");
  if (expected != sha256_hex(*bytes)) {
    return damaged(path, "its SHA-256 is not the one in dataset.json");
  }
  auto image = decode_image(*bytes, {.bytes = kFileLimit, .channels = channels});
  if (!image) return image.error().in(path.string());
  return image;
}

std::vector<Illumination*> lights_to_fill(Dataset& set) {
  std::vector<Illumination*> lights;
  for (Illumination& light : set.illuminations) lights.push_back(&light);
  if (set.uniform) lights.push_back(&*set.uniform);
  return lights;
}

Result<void> fill_seen(const ImageFile& file, Dataset& set) {
  const auto cosine = select_channels(file, std::array<std::string, 1>{"view_cosine"});
  if (!cosine) return cosine.error();
  set.view_cosine = *cosine;
  const auto directions = direction_channels();
  if (std::ranges::find(file.channels, directions.front()) != file.channels.end()) {
    const auto direction = select_channels(file, directions);
    if (!direction) return direction.error();
    set.view_direction = *direction;
  }
  for (Illumination* light : lights_to_fill(set)) {
    const auto pixels = select_channels(file, seen_channels(light->name));
    if (!pixels) return pixels.error();
    const int width = pixels->width();
    const int height = pixels->height();
    light->radiance = Image<float>(width, height, kColorChannels);
    light->radiance_variance = Image<float>(width, height, kColorChannels);
    light->mask = Image<std::uint8_t>(width, height, 1);
    copy_out(*pixels, 0, light->radiance);
    copy_out(*pixels, 3, light->radiance_variance);
    copy_out(*pixels, 6, light->mask);
  }
  return ok();
}

Result<void> fill_light(const ImageFile& file, Dataset& set) {
  for (Illumination* light : lights_to_fill(set)) {
    auto pixels = select_channels(file, rgb(light->name + ".irradiance"));
    if (!pixels) return pixels.error();
    light->irradiance = *std::move(pixels);
  }
  return ok();
}

}  // namespace

Result<void> write_dataset(FileOperations& files, const fs::path& directory, const Dataset& set) {
  if (auto checked = check(set); !checked) return checked;
  const auto seen = write_image(files, directory / kSeenFile, seen_image(set));
  if (!seen) return seen.error();
  const auto light = write_image(files, directory / kLightFile, light_image(set));
  if (!light) return light.error();
  json sidecar = describe(set);
  sidecar["sha256"] = {{kSeenFile, *seen}, {kLightFile, *light}};
  return write_whole(files, directory / kSidecar, sidecar.dump(2) + "\n");
}

Result<Dataset> read_dataset(const fs::path& directory) {
  const auto sidecar = read_sidecar(directory / kSidecar);
  if (!sidecar) return sidecar.error();
  auto set = parse_header(directory / kSidecar, *sidecar);
  if (!set) return set.error();
  const int count = static_cast<int>(lights_of(*set).size());
  const auto seen =
      read_image(directory / kSeenFile, *sidecar, 1 + kDirectionChannels + kSeenChannels * count);
  if (!seen) return seen.error();
  const auto light =
      read_image(directory / kLightFile, *sidecar, std::max(1, kLightChannels * count));
  if (!light) return light.error();
  if (auto filled = fill_seen(*seen, *set); !filled) return filled.error();
  if (auto filled = fill_light(*light, *set); !filled) return filled.error();
  if (auto checked = check(*set); !checked)
    return damaged(directory / kSidecar, checked.error().message);
  return set;
}

}  // namespace opaline
