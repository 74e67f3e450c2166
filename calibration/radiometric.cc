#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calibration/sensor_noise.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr double kRatio = 1.5;
constexpr double kCurvesDiffer = 0.01;  // of full scale
constexpr double kTimesOff = 0.01;
constexpr double kUnsure = 0.001;
constexpr double kGainUnsure = 0.03;
constexpr double kGainsDiffer = 0.08;
constexpr double kLowest = 0.02;  // of the code range, for the times
constexpr double kHighest = 0.85;

Result<StepRecord> refused(StepRecord record, std::string gate, const std::string& why) {
  record.gates.push_back({std::move(gate), 2.0, 1.0, "", why});
  return record;
}

double largest_difference(const std::vector<capture::ResponseCurve>& curves) {
  double most = 0.0;
  for (int i = 5; i <= 95; ++i) {
    std::array<double, 3> s{};
    for (std::size_t c = 0; c < 3; ++c) s[c] = signal_at(curves[c], 0.01 * i);
    most = std::max(most, std::ranges::max(s) - std::ranges::min(s));
  }
  return most;
}

capture::ResponseCurve mean_curve(const std::vector<capture::ResponseCurve>& curves) {
  capture::ResponseCurve mean = curves.front();
  for (std::size_t i = 0; i < mean.table.size(); ++i)
    mean.table[i] = (curves[0].table[i] + curves[1].table[i] + curves[2].table[i]) / 3.0;
  return mean;
}

// Of a sensor that is not linear: the mean of what the channels say, told better by more exposures than the linearity step had.
Result<void> find_response(StepContext& context, const Stack& stack, StepRecord& record) {
  auto fits = fit_channels(context, stack);
  if (!fits) return fits.error();
  std::vector<capture::ResponseCurve> curves;
  for (ResponseFit& fit : *fits) curves.push_back(std::move(fit.curve));
  record.gates.push_back({"channels respond differently",
                          largest_difference(curves),
                          kCurvesDiffer,
                          "of full scale",
                          "switch off the camera's picture styles; use raw pictures"});
  context.record.measured.response = mean_curve(curves);
  return ok();
}

// How many times as long as the exposure before it an exposure was, by the light of the samples that both tell of, which are
// chosen by the frames that do not count, so that noise chooses none.
struct Growth {
  double times = 0.0;
  double deviation = 1.0;  // standard, relative
};

Growth growth(const Stack& stack,
              std::size_t j,
              CodeRange range,
              const std::vector<double>& linear,
              const Image<std::uint8_t>& good) {
  const double low = range.black + kLowest * (range.clipping - range.black);
  const double high = range.black + kHighest * (range.clipping - range.black);
  std::array<double, 2> sum{};
  std::array<double, 2> variance{};
  for (std::size_t i = 0; i < stack.first[j].pixels.samples().size(); ++i) {
    if (good.samples()[i / 3] == 0 || stack.second[j - 1].pixels.samples()[i] < low ||
        stack.second[j].pixels.samples()[i] > high)
      continue;
    for (std::size_t k = 0; k < 2; ++k) {
      const double first = linear[stack.first[j - 1 + k].pixels.samples()[i]];
      const double difference = first - linear[stack.second[j - 1 + k].pixels.samples()[i]];
      sum[k] += first;
      variance[k] += 0.5 * difference * difference;
    }
  }
  if (!(sum[0] > 0.0 && sum[1] > 0.0)) return {};
  return {sum[1] / sum[0],
          std::sqrt(variance[0] / (sum[0] * sum[0]) + variance[1] / (sum[1] * sum[1]))};
}

// The largest departure of a measured exposure from the reported one, their scale being free, as far as enough samples tell.
double exposure_error(StepContext& context, const Stack& stack, StepRecord& record) {
  const auto linear = linear_codes(linear_camera(context));
  const auto good = good_pixels(context);
  std::vector<double> off{0.0};
  double chain = 0.0;
  for (std::size_t j = 1; j < stack.first.size(); ++j) {
    const double told =
        seconds_of(stack.first[j].exposure) / seconds_of(stack.first[j - 1].exposure);
    const Growth seen = growth(stack, j, code_range(context), linear, good);
    if (seen.deviation > kUnsure) break;
    chain += std::log(seen.times / told);
    off.push_back(chain);
  }
  std::vector<double> sorted = off;
  std::ranges::sort(sorted);
  const double middle = sorted[sorted.size() / 2];
  double most = 0.0;
  nlohmann::json measured = nlohmann::json::array();
  for (std::size_t j = 0; j < off.size(); ++j) {
    most = std::max(most, std::abs(std::expm1(off[j] - middle)));
    const double said = seconds_of(stack.first[j].exposure);
    measured.push_back({{"reported_s", said}, {"measured_s", said * std::exp(off[j] - middle)}});
  }
  record.values["exposures"] = std::move(measured);
  return most;
}

Result<std::vector<PhotonTransfer>> transfer_noise(StepContext& context, const Stack& stack) {
  std::vector<FramePair> pairs;
  for (std::size_t j = 0; j < stack.first.size(); ++j)
    pairs.push_back({&stack.first[j].pixels, &stack.second[j].pixels});
  std::vector<PhotonTransfer> channels;
  for (int c = 0; c < 3; ++c) {
    auto found = photon_transfer(pairs, code_range(context), c, *context.record.measured.response);
    if (!found) return found.error();
    channels.push_back(*found);
  }
  return channels;
}

// Through a curve, rounding and not read noise makes up most of what photon transfer finds at no light; of the samples above
// black in the dark it is the rms, as noise is symmetric there. In linear codes.
Result<double> noise_in_the_dark(StepContext& context) {
  const auto frame = context.taker.dark(std::chrono::milliseconds(10), context.stop);
  if (!frame) return frame.error();
  const auto linear = linear_codes(linear_camera(context));
  const auto good = good_pixels(context);
  const double black = *context.record.measured.black_level;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < frame->pixels.samples().size(); ++i) {
    const std::uint16_t code = frame->pixels.samples()[i];
    if (good.samples()[i / 3] == 0 || code <= black) continue;
    squares += linear[code] * linear[code];
    count += 1.0;
  }
  return std::sqrt(squares / std::max(count, 1.0));
}

void note_noise(StepContext& context,
                const std::vector<PhotonTransfer>& channels,
                std::optional<double> dark,
                StepRecord& record) {
  std::vector<double> gains;
  std::vector<double> reads;
  double unsure = 0.0;
  bool resolved = true;
  for (const PhotonTransfer& t : channels) {
    gains.push_back(t.electrons_per_code);
    reads.push_back(t.read_noise_electrons);
    unsure = std::max(unsure, t.electrons_per_code_deviation / t.electrons_per_code);
    resolved = resolved && t.read_noise_resolved;
  }
  Measured& m = context.record.measured;
  m.gain_electrons_per_code = mean_of(gains);
  m.read_noise_electrons = dark ? *dark * mean_of(gains) : mean_of(reads);
  record.values["gain_electrons_per_code"] = gains;
  record.values["read_noise_electrons"] = *m.read_noise_electrons;
  record.values["read_noise_resolved"] = resolved || dark;
  const auto [low, high] = std::ranges::minmax(gains);
  record.gates.push_back({"gain is uncertain",
                          unsure,
                          kGainUnsure,
                          "relative",
                          "light more of the picture, or evenly: more samples tell of the noise"});
  record.gates.push_back({"channels differ in gain",
                          (high - low) / mean_of(gains),
                          kGainsDiffer,
                          "relative",
                          "switch off the camera's white balance and noise reduction"});
}

}  // namespace

Result<StepRecord> radiometric(StepContext& context) {
  StepRecord record{"radiometric", {}, {}, {}};
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  if (!record.accepted()) return record;
  const auto dim = find_dim_light(context);
  if (!dim) return dim.error();
  const auto stack = take_stack(context, *dim, kRatio, true);
  if (!stack) return stack.error();
  const bool linear =
      context.record.measured.response->kind == capture::ResponseCurve::Kind::kLinear;
  if (!linear) {
    if (auto found = find_response(context, *stack, record); !found)
      return refused(std::move(record), "response cannot be told", found.error().message);
  }
  record.values["response"] = linear ? "linear" : "table";
  record.gates.push_back({"exposure times",
                          exposure_error(context, *stack, record),
                          kTimesOff,
                          "relative",
                          "the camera's shutter is not what it reports: set it to manual exposure, "
                          "and keep to exposures that agree (\"opaline calibration show\")"});
  const auto channels = transfer_noise(context, *stack);
  if (!channels)
    return refused(std::move(record), "noise cannot be told", channels.error().message);
  std::optional<double> dark;
  if (!linear) {
    const auto found = noise_in_the_dark(context);
    if (!found) return found.error();
    dark = *found;
  }
  note_noise(context, *channels, dark, record);
  return record;
}

}  // namespace opaline::calibration
