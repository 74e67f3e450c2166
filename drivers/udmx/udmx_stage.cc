#include "drivers/udmx/udmx_stage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "base/log.h"

namespace opaline::drivers {
namespace {

constexpr std::uint8_t kOneChannel = 1;
constexpr std::uint8_t kChannelRange = 2;
constexpr std::chrono::milliseconds kPatience{250};
constexpr std::size_t kMostInterfaces = 4;

}  // namespace

Result<void> validate(const UdmxOptions& o) {
  const auto bad = [](std::string_view name, int value, std::string_view expected) {
    return invalid_argument(fmt::format("{} = {}; expected {}", name, value, expected));
  };
  if (o.lights.empty()) return invalid_argument("no lights; expected at least one");
  if (o.channels_per_light < 1 || o.channels_per_light > 16)
    return bad("channels_per_light", o.channels_per_light, "1 to 16");
  if (o.first_channel < 1) return bad("first_channel", o.first_channel, "at least 1");
  const auto most = static_cast<std::int64_t>(512 * kMostInterfaces);
  const std::int64_t end =
      o.first_channel + static_cast<std::int64_t>(o.lights.size()) * o.channels_per_light;
  if (end - 1 > most)
    return invalid_argument(fmt::format(
        "{} lights end at channel {}; expected at most {}", o.lights.size(), end - 1, most));
  if (o.polarizer_channel < 0 || o.polarizer_channel > most)
    return bad("polarizer_channel", o.polarizer_channel, "0 to 2048");
  if (o.polarizer_channel >= o.first_channel && o.polarizer_channel < end)
    return bad("polarizer_channel", o.polarizer_channel, "none of the lights' channels");
  return ok();
}

std::size_t UdmxStage::used_channels() const {
  const std::size_t lights =
      static_cast<std::size_t>(options_.first_channel - 1) +
      options_.lights.size() * static_cast<std::size_t>(options_.channels_per_light);
  return std::max(lights, static_cast<std::size_t>(options_.polarizer_channel));
}

LightStageInfo UdmxStage::describe() const {
  std::string places;
  for (const Interface& interface : interfaces_) {
    if (!places.empty()) places += ", ";
    places += interface.port->name();
  }
  return {"uDMX",
          places,
          options_.lights,
          options_.period,
          options_.latency,
          options_.polarizer_channel > 0};
}

Result<UdmxStage::Interfaces> UdmxStage::open_interfaces() {
  if (auto good = validate(options_); !good) return good.error().in("uDMX");
  auto found = bus_->open_all();
  if (!found) return found.error();
  std::vector<std::string> places;
  for (const auto& port : *found) places.push_back(port->name());
  const std::vector<std::string>& wanted =
      options_.interfaces.empty() ? places : options_.interfaces;
  const std::size_t needed = (used_channels() + kChannels - 1) / kChannels;
  if (wanted.size() < needed)
    return not_found(
        fmt::format("{} channels need {} uDMX interfaces (USB 16c0:05dc), and there are {}: is one "
                    "unplugged?",
                    used_channels(),
                    needed,
                    wanted.size()));
  Interfaces interfaces;
  for (const std::string& place : wanted) {
    const auto at = std::ranges::find(places, place);
    if (at == places.end())
      return not_found(
          fmt::format("no uDMX interface at {}; there are: {}",
                      place,
                      places.empty() ? "none" : fmt::format("{}", fmt::join(places, ", "))));
    auto& port = (*found)[static_cast<std::size_t>(at - places.begin())];
    if (!port) return invalid_argument(fmt::format("uDMX interface {} is named twice", place));
    if (interfaces.size() < needed) interfaces.push_back({std::move(port), {}});
  }
  return interfaces;
}

Result<void> UdmxStage::send(Interface& interface,
                             const Values& values,
                             std::size_t used,
                             bool all) const {
  std::size_t first = 0;
  std::size_t last = used;  // one behind
  if (!all) {
    while (first < last && values[first] == interface.sent[first]) ++first;
    while (last > first && values[last - 1] == interface.sent[last - 1]) --last;
  }
  if (first == last) return ok();
  const auto index = static_cast<std::uint16_t>(first);
  Result<void> sent =
      last - first == 1
          ? interface.port->write({kOneChannel, values[first], index}, {}, kPatience)
          : interface.port->write({kChannelRange, static_cast<std::uint16_t>(last - first), index},
                                  std::span(values).subspan(first, last - first),
                                  kPatience);
  if (sent) interface.sent = values;
  return sent;
}

/// Tries every interface, whatever becomes of the others.
Result<void> UdmxStage::darken(Interfaces& interfaces) const {
  Result<void> result = ok();
  std::size_t left = used_channels();
  for (Interface& interface : interfaces) {
    const std::size_t used = std::min(left, kChannels);
    left -= used;
    if (auto sent = send(interface, {}, used, true); !sent && result) result = std::move(sent);
  }
  return result;
}

Result<void> UdmxStage::open() {
  const std::lock_guard lock(mutex_);
  interfaces_.clear();
  auto opened = open_interfaces();
  if (!opened) return opened.error();
  if (auto dark = darken(*opened); !dark) return dark;
  interfaces_ = *std::move(opened);
  return ok();
}

Result<LightStageInfo> UdmxStage::info() const {
  const std::lock_guard lock(mutex_);
  if (interfaces_.empty()) return unavailable("uDMX: not open");
  return describe();
}

std::vector<UdmxStage::Values> UdmxStage::values_of(const StagePattern& pattern) const {
  std::vector<Values> values(interfaces_.size(), Values{});
  const auto put = [&](std::size_t channel, std::uint8_t value) {
    values[channel / kChannels][channel % kChannels] = value;
  };
  const auto per_light = static_cast<std::size_t>(options_.channels_per_light);
  for (std::size_t n = 0; n < pattern.codes.size(); ++n)
    for (std::size_t c = 0; c < per_light; ++c)
      put(static_cast<std::size_t>(options_.first_channel - 1) + n * per_light + c,
          pattern.codes[n]);
  if (options_.polarizer_channel > 0)
    put(static_cast<std::size_t>(options_.polarizer_channel - 1),
        pattern.polarization == Polarization::kCross ? options_.cross_code
                                                     : options_.parallel_code);
  return values;
}

Result<void> UdmxStage::set(const StagePattern& pattern, std::stop_token stop) {
  std::vector<Values> values;
  std::uint64_t blanks = 0;
  {
    const std::lock_guard lock(mutex_);
    if (interfaces_.empty()) return unavailable("uDMX: not open");
    if (auto good = check(pattern, describe()); !good) return good;
    values = values_of(pattern);
    blanks = blanks_;
  }
  std::size_t left = used_channels();
  for (std::size_t n = 0; n < values.size(); ++n) {
    const std::lock_guard lock(mutex_);
    if (blanks != blanks_) return cancelled("set: made dark meanwhile");
    if (interfaces_.empty()) return unavailable("uDMX: closed meanwhile");
    if (stop.stop_requested()) {
      // Half of the new pattern is no pattern.
      if (n > 0 && !darken(interfaces_)) interfaces_.clear();
      return cancelled("set: stopped");
    }
    const std::size_t used = std::min(left, kChannels);
    left -= used;
    if (auto sent = send(interfaces_[n], values[n], used, false); !sent) {
      if (!darken(interfaces_)) log::warning("uDMX: lost while lit");
      interfaces_.clear();
      return sent;
    }
  }
  return ok();
}

Result<void> UdmxStage::blank() {
  const std::lock_guard lock(mutex_);
  ++blanks_;
  if (!interfaces_.empty()) return darken(interfaces_);
  auto opened = open_interfaces();
  if (!opened) return opened.error();
  return darken(*opened);
}

void UdmxStage::close_dark() noexcept {
  const std::lock_guard lock(mutex_);
  if (interfaces_.empty()) return;
  ++blanks_;
  if (auto dark = darken(interfaces_); !dark)
    log::warning("uDMX: closed, and may be lit: {}", dark.error().message);
  interfaces_.clear();
}

}  // namespace opaline::drivers
