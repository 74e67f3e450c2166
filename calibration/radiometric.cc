#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calibration/exposure_times.h"
#include "calibration/sensor_noise.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr double kRatio = 1.5;
constexpr double kCurvesDiffer = 0.01;  // of full scale
constexpr double kTimesOff = 0.01;
constexpr double kGainUnsure = 0.03;
constexpr double kGainsDiffer = 0.08;

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

double exposure_error(StepContext& context, const Stack& stack, StepRecord& record) {
  const ExposureTimes times = measure_exposures(stack.first,
                                                stack.second,
                                                code_range(context),
                                                linear_codes(linear_camera(context)),
                                                good_pixels(context));
  nlohmann::json measured = nlohmann::json::array();
  for (const auto& one : times.exposures)
    measured.push_back({{"reported_s", one.reported}, {"measured_s", one.reported * one.factor}});
  record.values["exposures"] = std::move(measured);
  context.record.measured.exposure_factors = times.corrections();
  return times.largest_error;
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
  for (const PhotonTransfer& t : channels) {
    nlohmann::json levels = nlohmann::json::array();
    for (const NoiseLevel& level : t.levels) levels.push_back({level.mean, level.variance});
    record.values["photon_transfer"].push_back(std::move(levels));
  }
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
