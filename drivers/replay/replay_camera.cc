#include "drivers/replay/replay_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "base/files.h"
#include "base/io/image_io.h"
#include "base/seconds.h"
#include "base/sha256.h"

namespace opaline::drivers {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kFileLimit = std::size_t{1} << 30;

CameraInfo describe(const ReplayIndex& index, const std::filesystem::path& folder) {
  const auto [shortest, longest] = std::minmax_element(
      index.photographs.begin(), index.photographs.end(), [](const auto& a, const auto& b) {
        return a.exposure < b.exposure;
      });
  return {index.model,
          folder.string(),
          index.width,
          index.height,
          index.bit_depth,
          shortest->exposure * 9 / 10,
          longest->exposure * 11 / 10};
}

/// A photograph without an id is of whichever pattern has its name.
bool shows(const Photograph& photograph, const ExposureRequest& request) {
  if (photograph.pattern_id) return *photograph.pattern_id == request.expected_pattern;
  return photograph.pattern == request.expected_name;
}

/// The best photograph, or none of that pattern.
const Photograph* find(const ReplayIndex& index, const ExposureRequest& request) {
  const Photograph* best = nullptr;
  double best_ratio = 0.0;
  for (const Photograph& photograph : index.photographs) {
    if (!shows(photograph, request)) continue;
    const double ratio =
        std::abs(std::log(seconds(photograph.exposure) / seconds(request.exposure)));
    if (best == nullptr || ratio < best_ratio) {
      best = &photograph;
      best_ratio = ratio;
    }
  }
  return best;
}

/// "1 (region_0_0)", "1", or "region_0_0".
std::string label(std::optional<std::uint64_t> id, const std::string& name) {
  if (!id) return name;
  return name.empty() ? fmt::format("{}", *id) : fmt::format("{} ({})", *id, name);
}

/// The patterns there are photographs of, the first few.
std::string patterns_of(const ReplayIndex& index) {
  std::set<std::pair<std::optional<std::uint64_t>, std::string>> patterns;
  for (const Photograph& photograph : index.photographs) {
    patterns.emplace(photograph.pattern_id, photograph.pattern);
  }
  std::string text;
  int listed = 0;
  for (const auto& [id, name] : patterns) {
    if (++listed > 8) return text + ", ...";
    text += (listed > 1 ? ", " : "") + label(id, name);
  }
  return text;
}

/// Samples as codes, grey counted for three channels, alpha left out.
template <class T, class ToCode>
Result<Image<std::uint16_t>> codes_of(const Image<T>& image,
                                      const ReplayIndex& index,
                                      ToCode to_code) {
  if (image.width() != index.width || image.height() != index.height) {
    return unavailable(fmt::format("{} x {} pixels; expected {} x {}",
                                   image.width(),
                                   image.height(),
                                   index.width,
                                   index.height));
  }
  const double max_code = static_cast<double>((1 << index.bit_depth) - 1);
  Image<std::uint16_t> codes(image.width(), image.height(), 3);
  const auto stride = static_cast<std::size_t>(image.channels());
  for (std::size_t i = 0; i < codes.samples().size(); ++i) {
    const std::size_t channel = stride >= 3 ? i % 3 : 0;
    const double code = to_code(static_cast<double>(image.samples()[i / 3 * stride + channel]));
    if (!(code >= 0.0 && code <= max_code)) {
      return unavailable(fmt::format("a code of {}; expected 0 to {}", code, max_code));
    }
    codes.samples()[i] = static_cast<std::uint16_t>(code);
  }
  return codes;
}

Result<Image<std::uint16_t>> codes_of(const ImageFile& file, const ReplayIndex& index) {
  if (const auto* light = std::get_if<Image<float>>(&file.pixels)) {
    const double max_code = static_cast<double>((1 << index.bit_depth) - 1);
    return codes_of(*light, index, [&](double value) {
      return std::clamp(std::round(index.codes_per_unit * value), 0.0, max_code);
    });
  }
  const auto same = [](double value) { return value; };
  if (const auto* bytes = std::get_if<Image<std::uint8_t>>(&file.pixels)) {
    if (index.bit_depth == 8) return codes_of(*bytes, index, same);
    return unavailable(
        fmt::format("has 8 bits, and the index says bit_depth = {}; expected 8", index.bit_depth));
  }
  return codes_of(std::get<Image<std::uint16_t>>(file.pixels), index, same);
}

/// Asks before each step, any of which may take a while, whether it is still wanted.
Result<Image<std::uint16_t>> read_photograph(const std::filesystem::path& path,
                                             const Photograph& photograph,
                                             const ReplayIndex& index,
                                             const std::function<bool()>& unwanted) {
  const Error stopped = cancelled("stopped");
  const auto bytes = read_bytes(path, kFileLimit);
  if (!bytes) return unavailable(bytes.error().message);
  if (unwanted()) return stopped;
  if (!photograph.sha256.empty() && sha256_hex(*bytes) != photograph.sha256) {
    return unavailable(fmt::format("{}: SHA-256 differs from the index", path.string()));
  }
  if (unwanted()) return stopped;
  const auto file = decode_image(*bytes);
  if (!file) return unavailable(fmt::format("{}: {}", path.string(), file.error().message));
  if (unwanted()) return stopped;
  auto codes = codes_of(*file, index);
  if (!codes) return codes.error().in(path.string());
  if (unwanted()) return stopped;
  return codes;
}

Result<void> check_range(const CameraInfo& info, nanoseconds exposure) {
  if (exposure >= info.shortest_exposure && exposure <= info.longest_exposure) return ok();
  return invalid_argument(fmt::format("exposure of {} s; expected {} to {} s",
                                      seconds(exposure),
                                      seconds(info.shortest_exposure),
                                      seconds(info.longest_exposure)));
}

}  // namespace

Result<void> ReplayCamera::open() {
  auto index = read_replay_index(folder_);
  if (!index) return index.error();
  const std::lock_guard lock(mutex_);
  index_ = std::make_shared<const ReplayIndex>(*std::move(index));
  trigger_count_ = 0;
  return ok();
}

Result<CameraInfo> ReplayCamera::info() const {
  const std::lock_guard lock(mutex_);
  if (!index_) return unavailable("replay camera: not open");
  return describe(*index_, folder_);
}

bool ReplayCamera::is_open_with(const Index& index) const {
  const std::lock_guard lock(mutex_);
  return index_ == index;
}

Result<Frame> ReplayCamera::read_frame(const Index& index,
                                       const ExposureRequest& request,
                                       const std::stop_token& stop) const {
  const Photograph* photograph = find(*index, request);
  if (photograph == nullptr) {
    return not_found(fmt::format("{}: no photograph of pattern {}; there are {}",
                                 folder_.string(),
                                 label(request.expected_pattern, request.expected_name),
                                 patterns_of(*index)));
  }
  Frame frame;
  frame.start = clock_.now();
  auto pixels = read_photograph(folder_ / photograph->file, *photograph, *index, [&] {
    return stop.stop_requested() || !is_open_with(index);
  });
  if (!pixels) return pixels.error().in("replay camera");
  frame.pixels = *std::move(pixels);
  frame.bit_depth = index->bit_depth;
  frame.pattern_id = photograph->pattern_id.value_or(request.expected_pattern);
  frame.exposure = photograph->exposure;
  frame.sha256 = frame_hash(frame.pixels);
  return frame;
}

Result<Frame> ReplayCamera::capture(const ExposureRequest& request, std::stop_token stop) {
  const Index index = [&] {
    const std::lock_guard lock(mutex_);
    return index_;
  }();
  if (!index) return unavailable("replay camera: not open");
  if (stop.stop_requested()) return cancelled("replay camera: stopped");
  if (auto good = check_range(describe(*index, folder_), request.exposure); !good)
    return good.error();
  Result<Frame> frame = read_frame(index, request, stop);
  const std::lock_guard lock(mutex_);
  if (index_ != index) return cancelled("replay camera: closed");
  if (frame) frame->trigger_count = ++trigger_count_;
  if (!frame && frame.error().code == ErrorCode::kUnavailable) index_.reset();
  return frame;
}

void ReplayCamera::close() noexcept {
  const std::lock_guard lock(mutex_);
  index_.reset();
}

}  // namespace opaline::drivers
