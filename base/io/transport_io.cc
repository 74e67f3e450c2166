#include "base/io/transport_io.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/material.h"
#include "base/sha256.h"

namespace opaline {
namespace {

constexpr std::string_view kMagic = "opaline transport ";
constexpr int kVersion = 1;
constexpr std::size_t kHashLength = 65;  // with its newline
constexpr std::size_t kMostBytes = std::size_t{2} << 30;
constexpr std::size_t kMostHeader = 1 << 20;
constexpr std::size_t kSampleBytes = sizeof(float) + sizeof(std::uint16_t);

std::uint16_t variance_code(float variance) {
  if (!(variance > 0.0F)) return 0;
  const double steps = (std::log2(static_cast<double>(variance)) + 140.0) * 256.0;
  return static_cast<std::uint16_t>(std::clamp(std::round(steps) + 1.0, 1.0, 65535.0));
}

float variance_of(std::uint16_t code) {
  if (code == 0) return 0.0F;
  return static_cast<float>(std::exp2((code - 1) / 256.0 - 140.0));
}

/// Appends values as planes of bytes, least significant first.
template <class T>
void append_planes(std::vector<std::byte>& bytes, std::span<const T> values) {
  for (std::size_t plane = 0; plane < sizeof(T); ++plane) {
    for (const T value : values) bytes.push_back(static_cast<std::byte>(value >> (8 * plane)));
  }
}

template <class T>
std::vector<T> take_planes(std::span<const std::byte>& bytes, std::size_t count) {
  std::vector<T> values(count);
  for (std::size_t plane = 0; plane < sizeof(T); ++plane) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto byte = static_cast<T>(bytes[plane * count + i]);
      values[i] = static_cast<T>(values[i] | static_cast<T>(byte << (8 * plane)));
    }
  }
  bytes = bytes.subspan(sizeof(T) * count);
  return values;
}

bool fits(const Image<float>& image, int width, int height) {
  return image.width() == width && image.height() == height && image.channels() == kColorChannels;
}

std::vector<std::byte> pictures_of(const TransportResponses& responses) {
  std::vector<std::byte> bytes;
  for (const PatchResponse& patch : responses.patches) {
    std::vector<std::uint32_t> radiance;
    for (const float value : patch.radiance.samples()) {
      radiance.push_back(std::bit_cast<std::uint32_t>(value));
    }
    std::vector<std::uint16_t> variance;
    for (const float value : patch.variance.samples()) variance.push_back(variance_code(value));
    append_planes<std::uint32_t>(bytes, radiance);
    append_planes<std::uint16_t>(bytes, variance);
  }
  return bytes;
}

Result<void> set_pictures(TransportResponses& responses, std::span<const std::byte> bytes) {
  const int width = responses.block.face_width(responses.seen_face);
  const int height = responses.block.face_height(responses.seen_face);
  const std::size_t samples = responses.block.face_cell_count(responses.seen_face) * kColorChannels;
  for (int i = 0; i < responses.patches_x * responses.patches_y; ++i) {
    PatchResponse patch{Image<float>(width, height, kColorChannels),
                        Image<float>(width, height, kColorChannels)};
    const auto radiance = take_planes<std::uint32_t>(bytes, samples);
    const auto variance = take_planes<std::uint16_t>(bytes, samples);
    for (std::size_t s = 0; s < samples; ++s) {
      patch.radiance.samples()[s] = std::bit_cast<float>(radiance[s]);
      patch.variance.samples()[s] = variance_of(variance[s]);
      if (!std::isfinite(patch.radiance.samples()[s])) {
        return invalid_argument("a radiance is not a number");
      }
    }
    responses.patches.push_back(std::move(patch));
  }
  return ok();
}

nlohmann::ordered_json header_of(const TransportResponses& r, std::size_t payload_bytes) {
  return {{"cells", r.block.cells()},
          {"spacing_mm", r.block.spacing()},
          {"ior", r.ior},
          {"lit_face", to_string(r.lit_face)},
          {"seen_face", to_string(r.seen_face)},
          {"diffuse_entry", r.diffuse_entry},
          {"patches", {r.patches_x, r.patches_y}},
          {"camera_centre_mm", {r.camera_centre.x, r.camera_centre.y, r.camera_centre.z}},
          {"anisotropy", r.anisotropy},
          {"seed", r.seed},
          {"passes", r.passes},
          {"photons_per_patch", r.photons_per_patch},
          {"generator", r.generator},
          {"scene", r.scene},
          {"payload_bytes", payload_bytes}};
}

Result<Face> face_named(const std::string& name) {
  for (const Face face : kFaces) {
    if (to_string(face) == name) return face;
  }
  return invalid_argument(fmt::format("no face is called \"{}\"", name));
}

/// Everything but the pictures; checks what the sizes of everything else follow from.
Result<TransportResponses> responses_from_header(const nlohmann::json& json) {
  TransportResponses r;
  const auto cells = json.at("cells").get<std::array<int, 3>>();
  const auto spacing = json.at("spacing_mm").get<std::array<double, 3>>();
  r.block = {cells[0], cells[1], cells[2], spacing[0], spacing[1], spacing[2]};
  r.ior = json.at("ior").get<double>();
  const auto lit = face_named(json.at("lit_face").get<std::string>());
  const auto seen = face_named(json.at("seen_face").get<std::string>());
  if (!lit) return lit.error();
  if (!seen) return seen.error();
  r.lit_face = *lit;
  r.seen_face = *seen;
  r.diffuse_entry = json.at("diffuse_entry").get<bool>();
  const auto patches = json.at("patches").get<std::array<int, 2>>();
  r.patches_x = patches[0];
  r.patches_y = patches[1];
  const auto centre = json.at("camera_centre_mm").get<std::array<double, 3>>();
  r.camera_centre = {centre[0], centre[1], centre[2]};
  r.anisotropy = json.at("anisotropy").get<double>();
  r.seed = json.at("seed").get<std::uint64_t>();
  r.passes = json.value("passes", 1);
  r.photons_per_patch = json.at("photons_per_patch").get<std::uint64_t>();
  r.generator = json.at("generator").get<std::string>();
  r.scene = json.at("scene").get<std::string>();
  const bool sane =
      std::all_of(cells.begin(), cells.end(), [](int n) { return n >= 1 && n <= 4096; }) &&
      std::all_of(spacing.begin(), spacing.end(), [](double h) { return h > 0.0 && h <= 1e6; }) &&
      r.patches_x >= 1 && r.patches_x <= 256 && r.patches_y >= 1 && r.patches_y <= 256;
  if (!sane) return invalid_argument("impossible sizes in its header");
  const bool possible = r.ior >= 1.0 && r.ior <= 3.0 && std::abs(r.anisotropy) < 1.0 &&
                        r.passes >= 1 && std::isfinite(length(r.camera_centre));
  if (!possible) return invalid_argument("impossible optics or passes in its header");
  return r;
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Takes a line off the front; nothing when there is no end of line within kMostHeader.
std::string_view take_line(std::span<const std::byte>& bytes) {
  const std::string_view text = text_of(bytes.first(std::min(bytes.size(), kMostHeader)));
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return {};
  bytes = bytes.subspan(end + 1);
  return text.substr(0, end);
}

Result<TransportResponses> decode_checked(std::span<const std::byte> bytes) {
  const nlohmann::json header = nlohmann::json::parse(take_line(bytes));
  auto responses = responses_from_header(header);
  if (!responses) return responses.error();
  const std::size_t expected =
      static_cast<std::size_t>(responses->patches_x) * responses->patches_y *
      responses->block.face_cell_count(responses->seen_face) * kColorChannels * kSampleBytes;
  if (expected > kMostBytes || header.at("payload_bytes").get<std::size_t>() != bytes.size()) {
    return invalid_argument("its header and its pictures do not fit");
  }
  std::vector<std::byte> pictures(expected);
  uLongf size = expected;
  const int code = ::uncompress(reinterpret_cast<Bytef*>(pictures.data()),
                                &size,
                                reinterpret_cast<const Bytef*>(bytes.data()),
                                bytes.size());
  if (code != Z_OK || size != expected) return invalid_argument("its pictures do not inflate");
  if (auto set = set_pictures(*responses, pictures); !set) return set.error();
  return responses;
}

}  // namespace

Result<std::vector<std::byte>> encode_transport(const TransportResponses& responses) {
  const std::size_t count = static_cast<std::size_t>(responses.patches_x) * responses.patches_y;
  const int width = responses.block.face_width(responses.seen_face);
  const int height = responses.block.face_height(responses.seen_face);
  bool whole = responses.patches.size() == count;
  for (const PatchResponse& patch : responses.patches) {
    whole = whole && fits(patch.radiance, width, height) && fits(patch.variance, width, height);
  }
  if (!whole) return invalid_argument("transport responses: pictures missing or of a wrong size");
  const std::vector<std::byte> pictures = pictures_of(responses);
  std::vector<std::byte> payload(::compressBound(pictures.size()));
  uLongf size = payload.size();
  ENSURE(::compress2(reinterpret_cast<Bytef*>(payload.data()),
                     &size,
                     reinterpret_cast<const Bytef*>(pictures.data()),
                     pictures.size(),
                     Z_BEST_COMPRESSION) == Z_OK);
  payload.resize(size);
  std::string text = fmt::format("{}{}\n", kMagic, kVersion);
  text += header_of(responses, payload.size()).dump() + '\n';
  text += text_of(payload);
  text += sha256_hex(std::as_bytes(std::span(text))) + '\n';
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

Result<TransportResponses> decode_transport(std::span<const std::byte> bytes) {
  const std::span<const std::byte> whole = bytes;
  const std::string_view first = take_line(bytes);
  if (!first.starts_with(kMagic)) return invalid_argument("not a file of transport responses");
  if (first.substr(kMagic.size()) != std::to_string(kVersion)) {
    return invalid_argument(fmt::format(
        "written by another version: \"{}\"; this one reads version {}", first, kVersion));
  }
  if (bytes.size() < kHashLength) return invalid_argument("cut short");
  const std::string_view hash = text_of(whole.last(kHashLength));
  if (hash != sha256_hex(whole.first(whole.size() - kHashLength)) + '\n') {
    return invalid_argument("cut short or damaged: its checksum does not match");
  }
  try {
    return decode_checked(bytes.first(bytes.size() - kHashLength));
  } catch (const nlohmann::json::exception& error) {
    return invalid_argument(fmt::format("its header: {}", error.what()));
  }
}

Result<void> write_transport(FileOperations& files,
                             const std::filesystem::path& path,
                             const TransportResponses& responses) {
  auto bytes = encode_transport(responses);
  if (!bytes) return bytes.error();
  return write_whole(files, path, *bytes);
}

Result<TransportResponses> read_transport(const std::filesystem::path& path) {
  auto bytes = read_bytes(path, kMostBytes);
  if (!bytes) return bytes.error();
  auto responses = decode_transport(*bytes);
  if (!responses) return responses.error().in(path.string());
  return responses;
}

Result<std::string> transport_checksum(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path, kMostBytes);
  if (!bytes) return bytes.error();
  if (bytes->size() < kHashLength) return invalid_argument(path.string() + ": cut short");
  return std::string(text_of(std::span(*bytes).last(kHashLength).first(kHashLength - 1)));
}

}  // namespace opaline
