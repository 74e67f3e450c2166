#include "capture/frame_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <variant>

#include "base/format_version.h"
#include "base/io/image_io.h"
#include "base/seconds.h"
#include "base/sha256.h"
#include "capture/exposure_plan.h"

namespace opaline::capture {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::nanoseconds;

constexpr int kFormat = 1;
constexpr std::size_t kFrameLimit = std::size_t{1} << 30;

// `repeat` counts the frames of the same exposure before it.
std::string file_name(const CapturedFrame& captured, std::ptrdiff_t repeat) {
  const double ms = std::chrono::duration<double, std::milli>(captured.exposure_asked).count();
  const std::string again = repeat > 0 ? fmt::format("-{}", repeat + 1) : std::string();
  return fmt::format("{:02}-{:.0f}ms{}.png", captured.exposure_index, ms, again);
}

json identity_of(const drivers::Pattern& pattern) {
  return {{"id", pattern.id}, {"sha256", sha256_hex(std::as_bytes(pattern.codes.samples()))}};
}

json describe(const CapturedFrame& captured, std::string file, std::string file_sha256) {
  const Frame& frame = captured.frame;
  return {{"file", std::move(file)},
          {"file_sha256", std::move(file_sha256)},
          {"pixels_sha256", frame.sha256},
          {"exposure_index", captured.exposure_index},
          {"exposure_asked_ns", captured.exposure_asked.count()},
          {"exposure_ns", frame.exposure.count()},
          {"start_ns", frame.start.count()},
          {"pattern_id", frame.pattern_id},
          {"trigger_count", frame.trigger_count},
          {"bit_depth", frame.bit_depth}};
}

Error damaged(const fs::path& path, std::string_view what) {
  return invalid_argument(fmt::format("{} is damaged: {}", path.string(), what));
}

// Throws nlohmann's exceptions on missing or wrong members; load() turns them into an Error.
CapturedFrame header_from(const json& entry) {
  CapturedFrame captured;
  captured.exposure_index = entry.at("exposure_index").get<std::size_t>();
  captured.exposure_asked = nanoseconds(entry.at("exposure_asked_ns").get<std::int64_t>());
  Frame& frame = captured.frame;
  frame.sha256 = entry.at("pixels_sha256").get<std::string>();
  frame.exposure = nanoseconds(entry.at("exposure_ns").get<std::int64_t>());
  frame.start = nanoseconds(entry.at("start_ns").get<std::int64_t>());
  frame.pattern_id = entry.at("pattern_id").get<std::uint64_t>();
  frame.trigger_count = entry.at("trigger_count").get<std::uint64_t>();
  frame.bit_depth = entry.at("bit_depth").get<int>();
  return captured;
}

Result<Image<std::uint16_t>> read_pixels(const fs::path& path, const std::string& sha256) {
  const auto bytes = read_bytes(path, kFrameLimit);
  if (!bytes) return bytes.error();
  if (sha256_hex(*bytes) != sha256) {
    return damaged(path,
                   fmt::format("its {} bytes are not those that were written", bytes->size()));
  }
  auto image = decode_image(*bytes);
  if (!image) return image.error().in(path.string());
  auto* pixels = std::get_if<Image<std::uint16_t>>(&image->pixels);
  if (pixels == nullptr) return damaged(path, "it does not hold 16-bit samples");
  return std::move(*pixels);
}

Result<CapturedFrame> read_frame(const fs::path& directory, const json& entry) {
  CapturedFrame captured = header_from(entry);
  if (captured.frame.exposure.count() <= 0) {
    return damaged(directory / "index.json", "an exposure is not > 0");
  }
  const fs::path file = fs::path(entry.at("file").get<std::string>()).filename();
  auto pixels = read_pixels(directory / file, entry.at("file_sha256").get<std::string>());
  if (!pixels) return pixels.error();
  captured.frame.pixels = *std::move(pixels);
  if (frame_hash(captured.frame.pixels) != captured.frame.sha256) {
    return damaged(directory / file, "its pixels are not those the camera hashed");
  }
  return captured;
}

Result<std::vector<CapturedFrame>> read_frames(const fs::path& directory, const json& index) {
  std::vector<CapturedFrame> frames;
  try {
    if (index.at("frames").size() > kMaxExposures) {
      return damaged(directory / "index.json", "it lists more frames than a light can have");
    }
    for (const json& entry : index.at("frames")) {
      auto frame = read_frame(directory, entry);
      if (!frame) return frame.error();
      frames.push_back(*std::move(frame));
    }
  } catch (const json::exception& e) {
    return damaged(directory / "index.json", e.what());
  }
  if (frames.empty()) return damaged(directory / "index.json", "it lists no frame");
  return frames;
}

}  // namespace

double seconds_asked(std::span<const CapturedFrame> frames) {
  double sum = 0.0;
  for (const CapturedFrame& frame : frames) sum += seconds(frame.exposure_asked);
  return sum;
}

Result<void> FrameStore::save(const std::string& light,
                              const drivers::Pattern& pattern,
                              std::span<const CapturedFrame> frames) {
  const fs::path directory = directory_ / light;
  if (auto made = files_.make_directories(directory); !made) return made;
  json entries = json::array();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const CapturedFrame& captured = frames[i];
    const auto bytes = encode_image({captured.frame.pixels, {}, {}}, ImageFormat::kPng);
    if (!bytes) return bytes.error().in(light);
    const std::string name =
        file_name(captured,
                  std::ranges::count(
                      frames.first(i), captured.exposure_index, &CapturedFrame::exposure_index));
    if (auto written = files_.write(directory / name, *bytes); !written) return written;
    if (auto synced = files_.sync(directory / name); !synced) return synced;
    entries.push_back(describe(captured, name, sha256_hex(*bytes)));
  }
  if (auto synced = files_.sync_directory(directory); !synced) return synced;
  const json index{{"format", kFormat},
                   {"light", light},
                   {"pattern", identity_of(pattern)},
                   {"frames", std::move(entries)}};
  return write_whole(files_, directory / "index.json", index.dump(2) + "\n");
}

Result<StoredLight> FrameStore::load(const std::string& light,
                                     const drivers::Pattern& pattern) const {
  const fs::path path = directory_ / light / "index.json";
  const auto text = read_text(path);
  if (!text && text.error().code == ErrorCode::kNotFound) return StoredLight{};
  if (!text) return StoredLight{{}, text.error().message};
  const json index = json::parse(*text, nullptr, false);
  if (!index.is_object()) return StoredLight{{}, damaged(path, "it is not JSON").message};
  const auto format = format_of(index);
  if (!format) return StoredLight{{}, damaged(path, "no format").message};
  if (*format > kFormat) return newer_format(path, *format, kFormat);
  if (index.value("pattern", json()) != identity_of(pattern)) return StoredLight{};
  auto frames = read_frames(directory_ / light, index);
  if (!frames) return StoredLight{{}, frames.error().message};
  return StoredLight{*std::move(frames), {}};
}

bool FrameStore::has(const std::string& light) const {
  std::error_code none;
  return std::filesystem::exists(directory_ / light / "index.json", none);
}

}  // namespace opaline::capture
