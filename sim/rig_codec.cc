#include "sim/rig_codec.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "sim/rig_header.h"

namespace opaline::sim {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "samples are sent as they lie in memory");

constexpr int kLargestSide = 8192;
constexpr int kMostPatches = 256;  // along a side

/// The value, or what was wrong on the way to it.
template <class T>
Result<T> unless_wrong(const RigHeader& header, T value) {
  if (auto good = header.result(); !good) return good.error();
  return value;
}

template <class T>
void append(RigMessage& message, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  message.payload.insert(message.payload.end(), bytes.begin(), bytes.end());
}

template <class T>
void put_image(RigMessage& message, const Image<T>& image) {
  message.header["width"] = image.width();
  message.header["height"] = image.height();
  message.header["channels"] = image.channels();
  append(message, std::span<const T>(image.samples()));
}

/// Of all of `bytes`; nothing is allocated before that is sure.
template <class T>
Result<Image<T>> get_image(RigHeader& header, std::span<const std::byte> bytes) {
  const int width = header.whole<int>("width", 0, kLargestSide);
  const int height = header.whole<int>("height", 0, kLargestSide);
  const int channels = header.whole<int>("channels", 1, 4);
  if (auto good = header.result(); !good) return good.error();
  if (bytes.size() != sizeof(T) * static_cast<std::size_t>(width) * height * channels) {
    return invalid_argument(fmt::format(
        "{} bytes for a picture of {} x {} x {}", bytes.size(), width, height, channels));
  }
  Image<T> image(width, height, channels);
  if (!bytes.empty()) std::memcpy(image.samples().data(), bytes.data(), bytes.size());
  return image;
}

json faults_to_json(const Faults& faults) {
  json list = json::array();
  for (const Fault& fault : faults) {
    list.push_back({{"kind", to_string(fault.kind)},
                    {"pattern", fault.pattern},
                    {"skip", fault.skip},
                    {"count", fault.count}});
  }
  return list;
}

Result<Faults> faults_from_json(const json& list) {
  if (!list.is_array()) return invalid_argument("faults: expected a list");
  Faults faults;
  for (const json& item : list) {
    RigHeader fields(item);
    const auto kind = fault_from_name(fields.text("kind"));
    const Fault fault{kind.value_or(FaultKind::kStaleFrame),
                      fields.whole<std::uint64_t>("pattern"),
                      fields.whole<int>("skip", 0),
                      fields.whole<int>("count", 1)};
    if (auto good = fields.result(); !good) return good.error().in("fault");
    if (!kind) return kind.error();
    faults.push_back(fault);
  }
  return faults;
}

}  // namespace

RigMessage encode(const Frame& frame) {
  RigMessage message{{{"bit_depth", frame.bit_depth},
                      {"pattern_id", frame.pattern_id},
                      {"trigger_count", frame.trigger_count},
                      {"start_ns", frame.start.count()},
                      {"exposure_ns", frame.exposure.count()},
                      {"sha256", frame.sha256}},
                     {}};
  put_image(message, frame.pixels);
  return message;
}

Result<Frame> decode_frame(const RigMessage& message) {
  RigHeader header(message.header);
  auto pixels = get_image<std::uint16_t>(header, message.payload);
  if (!pixels) return pixels.error();
  return unless_wrong(header,
                      Frame{*std::move(pixels),
                            header.whole<int>("bit_depth", 1, 16),
                            header.whole<std::uint64_t>("pattern_id"),
                            header.whole<std::uint64_t>("trigger_count"),
                            header.time("start_ns"),
                            header.time("exposure_ns"),
                            header.text("sha256")});
}

RigMessage encode(const drivers::Pattern& pattern) {
  RigMessage message{{{"pattern_id", pattern.id}}, {}};
  put_image(message, pattern.codes);
  return message;
}

Result<drivers::Pattern> decode_pattern(const RigMessage& message) {
  RigHeader header(message.header);
  auto codes = get_image<std::uint8_t>(header, message.payload);
  if (!codes) return codes.error();
  return unless_wrong(
      header, drivers::Pattern{header.whole<std::uint64_t>("pattern_id"), *std::move(codes)});
}

RigMessage encode(const RigStatus& status) {
  return {{{"identity", status.identity},
           {"lamp_on", status.lamp_on},
           {"pattern_id", status.pattern_id},
           {"exposures", status.exposures},
           {"camera_open", status.camera_open},
           {"projector_open", status.projector_open},
           {"rig_time_ns", status.rig_time.count()},
           {"time_factor", status.time_factor},
           {"faults", faults_to_json(status.faults)}},
          {}};
}

Result<RigStatus> decode_status(const RigMessage& message) {
  RigHeader header(message.header);
  auto faults = faults_from_json(header.find("faults"));
  if (!faults) return faults.error();
  return unless_wrong(header,
                      RigStatus{header.text("identity"),
                                header.flag("lamp_on"),
                                header.whole<std::uint64_t>("pattern_id"),
                                header.whole<std::uint64_t>("exposures"),
                                header.flag("camera_open"),
                                header.flag("projector_open"),
                                header.time("rig_time_ns"),
                                header.number("time_factor"),
                                *std::move(faults)});
}

/// Payload: the patches' irradiance, then the radiance. A header would not hold that of many patches.
RigMessage encode(const RigTruth& truth) {
  RigMessage message{{{"scene", truth.scene},
                      {"pattern_id", truth.pattern_id},
                      {"patches_x", truth.patches_x},
                      {"patches_y", truth.patches_y}},
                     {}};
  append(message, std::span<const Rgb>(truth.patch_irradiance));
  put_image(message, truth.surface_radiance);
  return message;
}

Result<RigTruth> decode_truth(const RigMessage& message) {
  RigHeader header(message.header);
  RigTruth truth{header.text("scene"),
                 header.whole<std::uint64_t>("pattern_id"),
                 header.whole<int>("patches_x", 0, kMostPatches),
                 header.whole<int>("patches_y", 0, kMostPatches),
                 {},
                 {}};
  if (auto good = header.result(); !good) return good.error();
  const std::span<const std::byte> payload = message.payload;
  const std::size_t patches = static_cast<std::size_t>(truth.patches_x) * truth.patches_y;
  if (payload.size() < patches * sizeof(Rgb)) {
    return invalid_argument(fmt::format("{} bytes for {} patches", payload.size(), patches));
  }
  truth.patch_irradiance.resize(patches);
  const auto irradiance = payload.first(patches * sizeof(Rgb));
  if (patches > 0) std::memcpy(truth.patch_irradiance.data(), irradiance.data(), irradiance.size());
  auto radiance = get_image<float>(header, payload.subspan(irradiance.size()));
  if (!radiance) return radiance.error();
  truth.surface_radiance = *std::move(radiance);
  return truth;
}

RigMessage encode(const Faults& faults) { return {{{"faults", faults_to_json(faults)}}, {}}; }

Result<Faults> decode_faults(const RigMessage& message) {
  return faults_from_json(RigHeader(message.header).find("faults"));
}

RigMessage encode(const RigPort::Opened<drivers::CameraInfo>& opened) {
  return {{{"session", opened.session},
           {"model", opened.info.model},
           {"serial", opened.info.serial},
           {"width", opened.info.width},
           {"height", opened.info.height},
           {"bit_depth", opened.info.bit_depth},
           {"shortest_exposure_ns", opened.info.shortest_exposure.count()},
           {"longest_exposure_ns", opened.info.longest_exposure.count()}},
          {}};
}

Result<RigPort::Opened<drivers::CameraInfo>> decode_opened_camera(const RigMessage& message) {
  RigHeader header(message.header);
  return unless_wrong(
      header,
      RigPort::Opened<drivers::CameraInfo>{header.whole<std::uint64_t>("session"),
                                           {header.text("model"),
                                            header.text("serial"),
                                            header.whole<int>("width", 1, kLargestSide),
                                            header.whole<int>("height", 1, kLargestSide),
                                            header.whole<int>("bit_depth", 1, 16),
                                            header.time("shortest_exposure_ns"),
                                            header.time("longest_exposure_ns")}});
}

RigMessage encode(const RigPort::Opened<drivers::ProjectorInfo>& opened) {
  return {{{"session", opened.session},
           {"model", opened.info.model},
           {"serial", opened.info.serial},
           {"width", opened.info.width},
           {"height", opened.info.height},
           {"frame_period_ns", opened.info.frame_period.count()},
           {"latency_ns", opened.info.latency.count()}},
          {}};
}

Result<RigPort::Opened<drivers::ProjectorInfo>> decode_opened_projector(const RigMessage& message) {
  RigHeader header(message.header);
  return unless_wrong(
      header,
      RigPort::Opened<drivers::ProjectorInfo>{header.whole<std::uint64_t>("session"),
                                              {header.text("model"),
                                               header.text("serial"),
                                               header.whole<int>("width", 1, kLargestSide),
                                               header.whole<int>("height", 1, kLargestSide),
                                               header.time("frame_period_ns"),
                                               header.time("latency_ns")}});
}

RigMessage encode(const Error& error) {
  return {{{"error", {{"code", to_string(error.code)}, {"message", error.message}}}}, {}};
}

Result<void> check_reply(const RigMessage& message) {
  const RigHeader header(message.header);
  if (header.find("error").is_null()) return ok();
  RigHeader error(header.find("error"));
  const std::string name = error.text("code");
  const std::string text = error.text("message");
  if (auto good = error.result(); !good) return good.error();
  for (int code = 0; code <= static_cast<int>(ErrorCode::kInternal); ++code) {
    if (to_string(static_cast<ErrorCode>(code)) == name) {
      return Error{static_cast<ErrorCode>(code), text};
    }
  }
  return internal_error(fmt::format("{}: {}", name, text));
}

}  // namespace opaline::sim
