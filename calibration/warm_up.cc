#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/step.h"

namespace opaline::calibration {
namespace {

using std::chrono::nanoseconds;

constexpr int kInARow = 8;    // for flicker
constexpr int kReadings = 5;  // apart, for drift
constexpr nanoseconds kApart = std::chrono::seconds(15);
constexpr nanoseconds kPatience = std::chrono::minutes(40);
constexpr double kDrift = 0.002;
constexpr double kFlicker = 0.005;

struct Reading {
  std::array<double, 3> channel{};
  double sum = 0.0;
};

class Lamp {
 public:
  Lamp(StepContext& context, const Brightness& brightness)
      : context_(context), brightness_(brightness), good_(good_pixels(context)) {
    linear_ = linear_codes(linear_camera(context));
  }

  Result<void> measure_dark() {
    auto frame = context_.taker.dark(kShort, context_.stop);
    if (!frame) return frame.error();
    dark_ = sum_of(*frame, linear_, good_);
    return ok();
  }

  Result<Reading> read() {
    auto frame = context_.taker.lit(brightness_.light, brightness_.turns, context_.stop);
    if (!frame) return frame.error();
    Reading reading{sum_of(*frame, linear_, good_)};
    for (std::size_t c = 0; c < 3; ++c) {
      reading.channel[c] = (reading.channel[c] - dark_[c]) / seconds_of(frame->exposure);
      reading.sum += reading.channel[c];
    }
    return reading;
  }

 private:
  static constexpr nanoseconds kShort = std::chrono::milliseconds(33);
  StepContext& context_;
  const Brightness& brightness_;
  Image<std::uint8_t> good_;
  std::vector<double> linear_;
  std::array<double, 3> dark_{};
};

double flicker_of(const std::vector<Reading>& readings) {
  std::vector<double> sums;
  sums.reserve(readings.size());
  for (const Reading& r : readings) sums.push_back(r.sum);
  return relative_deviation(sums);
}

// A beat with the wheel shifts light from one channel to another.
double beat_of(const std::vector<Reading>& readings) {
  double most = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> shares;
    shares.reserve(readings.size());
    for (const Reading& r : readings) shares.push_back(r.channel[c] / r.sum);
    most = std::max(most, relative_deviation(shares));
  }
  return most;
}

double drift_of(const std::vector<double>& sums) {
  const auto last = std::span(sums).last(kReadings);
  const auto [low, high] = std::ranges::minmax(last);
  return (high - low) / mean_of(last);
}

struct Drift {
  double left = 1.0;
  double seconds = 0.0;
};

Result<Drift> wait_until_steady(StepContext& context, Lamp& lamp) {
  const nanoseconds began = context.taker.now();
  std::vector<double> sums;
  Drift drift;
  for (;;) {
    auto reading = lamp.read();
    if (!reading) return reading.error();
    sums.push_back(reading->sum);
    drift.seconds = seconds_of(context.taker.now() - began);
    if (sums.size() >= static_cast<std::size_t>(kReadings)) {
      drift.left = drift_of(sums);
      if (drift.left <= kDrift || context.taker.now() - began >= kPatience) return drift;
    }
    context.progress(std::min(0.99, 0.2 + 0.16 * static_cast<double>(sums.size())),
                     fmt::format("lamp steady to {:.2f} %", 100.0 * drift.left));
    if (auto waited = context.taker.pause(kApart, context.stop); !waited) return waited.error();
  }
}

}  // namespace

Result<StepRecord> warm_up(StepContext& context) {
  StepRecord record{"warm_up", {}, {}, {}};
  context.progress(0.0, "looking for a light");
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  record.values["light_code"] = brightness->light[0];
  record.values["turns"] = brightness->turns;
  if (!record.accepted()) return record;
  Lamp lamp(context, *brightness);
  if (auto dark = lamp.measure_dark(); !dark) return dark.error();
  std::vector<Reading> readings;
  for (int i = 0; i < kInARow; ++i) {
    auto reading = lamp.read();
    if (!reading) return reading.error();
    readings.push_back(*reading);
  }
  const auto drift = wait_until_steady(context, lamp);
  if (!drift) return drift.error();
  record.values["seconds"] = drift->seconds;
  record.gates.push_back({"flicker",
                          flicker_of(readings),
                          kFlicker,
                          "of the light, from exposure to exposure",
                          "let the lamp warm up, keep room light out, check its power supply"});
  record.gates.push_back({"colour wheel beat",
                          beat_of(readings),
                          kFlicker,
                          "of a channel's share, from exposure to exposure",
                          "set the projector's frame period in the driver: exposures must be whole "
                          "turns of its wheel"});
  record.gates.push_back({"lamp drift",
                          drift->left,
                          kDrift,
                          "in a minute",
                          "give the lamp 30 minutes, then \"opaline calibrate --resume\""});
  return record;
}

}  // namespace opaline::calibration
