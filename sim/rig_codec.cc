#include "sim/rig_codec.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <utility>

namespace opaline::sim {
namespace {

using nlohmann::json;
using std::chrono::nanoseconds;

static_assert(std::endian::native == std::endian::little, "samples are sent as they lie in memory");

constexpr int kLargestSide = 8192;

/// Runs a decoder; what the JSON library throws at it becomes an error.
template <class Decode>
auto checked(Decode decode) -> decltype(decode()) {
  try {
    return decode();
  } catch (const json::exception& wrong) {
    return invalid_argument(
        fmt::format("not what was expected from the rig's socket: {}", wrong.what()));
  }
}

template <class T>
void put_image(RigMessage& message, const Image<T>& image) {
  message.header["width"] = image.width();
  message.header["height"] = image.height();
  message.header["channels"] = image.channels();
  const auto bytes = std::as_bytes(image.samples());
  message.payload.assign(bytes.begin(), bytes.end());
}

template <class T>
Result<Image<T>> get_image(const RigMessage& message) {
  const int width = message.header.at("width").get<int>();
  const int height = message.header.at("height").get<int>();
  const int channels = message.header.at("channels").get<int>();
  const auto sane = [](int side) { return side >= 0 && side <= kLargestSide; };
  if (!sane(width) || !sane(height) || channels < 1 || channels > 4) {
    return invalid_argument(fmt::format("a picture of {} x {} x {}", width, height, channels));
  }
  Image<T> image(width, height, channels);
  const auto bytes = std::as_writable_bytes(image.samples());
  if (bytes.size() != message.payload.size()) {
    return invalid_argument(fmt::format(
        "{} bytes for a picture of {} x {} x {}", message.payload.size(), width, height, channels));
  }
  if (!bytes.empty()) std::memcpy(bytes.data(), message.payload.data(), bytes.size());
  return image;
}

nanoseconds get_time(const json& header, const char* name) {
  return nanoseconds(header.at(name).get<nanoseconds::rep>());
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
  Faults faults;
  for (const json& item : list) {
    const auto kind = fault_from_name(item.at("kind").get<std::string>());
    if (!kind) return kind.error();
    const Fault fault{*kind, item.at("pattern"), item.at("skip"), item.at("count")};
    if (fault.skip < 0 || fault.count < 1) {
      return invalid_argument(fmt::format(
          "fault with skip = {}, count = {}; expected >= 0 and >= 1", fault.skip, fault.count));
    }
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
  return checked([&]() -> Result<Frame> {
    const json& header = message.header;
    auto pixels = get_image<std::uint16_t>(message);
    if (!pixels) return pixels.error();
    return Frame{*std::move(pixels),
                 header.at("bit_depth"),
                 header.at("pattern_id"),
                 header.at("trigger_count"),
                 get_time(header, "start_ns"),
                 get_time(header, "exposure_ns"),
                 header.at("sha256")};
  });
}

RigMessage encode(const drivers::Pattern& pattern) {
  RigMessage message{{{"pattern_id", pattern.id}}, {}};
  put_image(message, pattern.codes);
  return message;
}

Result<drivers::Pattern> decode_pattern(const RigMessage& message) {
  return checked([&]() -> Result<drivers::Pattern> {
    auto codes = get_image<std::uint8_t>(message);
    if (!codes) return codes.error();
    return drivers::Pattern{message.header.at("pattern_id"), *std::move(codes)};
  });
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
  return checked([&]() -> Result<RigStatus> {
    const json& header = message.header;
    auto faults = faults_from_json(header.at("faults"));
    if (!faults) return faults.error();
    return RigStatus{header.at("identity"),
                     header.at("lamp_on"),
                     header.at("pattern_id"),
                     header.at("exposures"),
                     header.at("camera_open"),
                     header.at("projector_open"),
                     get_time(header, "rig_time_ns"),
                     header.at("time_factor"),
                     *std::move(faults)};
  });
}

RigMessage encode(const RigTruth& truth) {
  RigMessage message{{{"scene", truth.scene},
                      {"pattern_id", truth.pattern_id},
                      {"patches_x", truth.patches_x},
                      {"patches_y", truth.patches_y},
                      {"patch_irradiance", truth.patch_irradiance}},
                     {}};
  put_image(message, truth.surface_radiance);
  return message;
}

Result<RigTruth> decode_truth(const RigMessage& message) {
  return checked([&]() -> Result<RigTruth> {
    const json& header = message.header;
    auto radiance = get_image<float>(message);
    if (!radiance) return radiance.error();
    return RigTruth{header.at("scene"),
                    header.at("pattern_id"),
                    header.at("patches_x"),
                    header.at("patches_y"),
                    header.at("patch_irradiance").get<std::vector<Rgb>>(),
                    *std::move(radiance)};
  });
}

RigMessage encode(const Faults& faults) { return {{{"faults", faults_to_json(faults)}}, {}}; }

Result<Faults> decode_faults(const RigMessage& message) {
  return checked([&] { return faults_from_json(message.header.at("faults")); });
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
  return checked([&]() -> Result<RigPort::Opened<drivers::CameraInfo>> {
    const json& h = message.header;
    return RigPort::Opened<drivers::CameraInfo>{h.at("session"),
                                                {h.at("model"),
                                                 h.at("serial"),
                                                 h.at("width"),
                                                 h.at("height"),
                                                 h.at("bit_depth"),
                                                 get_time(h, "shortest_exposure_ns"),
                                                 get_time(h, "longest_exposure_ns")}};
  });
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
  return checked([&]() -> Result<RigPort::Opened<drivers::ProjectorInfo>> {
    const json& h = message.header;
    return RigPort::Opened<drivers::ProjectorInfo>{h.at("session"),
                                                   {h.at("model"),
                                                    h.at("serial"),
                                                    h.at("width"),
                                                    h.at("height"),
                                                    get_time(h, "frame_period_ns"),
                                                    get_time(h, "latency_ns")}};
  });
}

RigMessage encode(const Error& error) {
  return {{{"error", {{"code", to_string(error.code)}, {"message", error.message}}}}, {}};
}

Result<void> check_reply(const RigMessage& message) {
  if (!message.header.contains("error")) return ok();
  return checked([&]() -> Result<void> {
    const json& error = message.header.at("error");
    const auto name = error.at("code").get<std::string>();
    for (int code = 0; code <= static_cast<int>(ErrorCode::kInternal); ++code) {
      if (to_string(static_cast<ErrorCode>(code)) != name) continue;
      return Error{static_cast<ErrorCode>(code), error.at("message").get<std::string>()};
    }
    return internal_error(fmt::format("{}: {}", name, error.at("message").get<std::string>()));
  });
}

}  // namespace opaline::sim
