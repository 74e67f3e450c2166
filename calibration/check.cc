#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/measured_station.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

using std::chrono::milliseconds;

constexpr double kRatesDiffer = 0.01;
constexpr double kNoiseOff = 0.1;
constexpr double kCurved =
    3.0;  // times as much through a curve, which is told to 1 % of full scale, and less well near black
constexpr double kBlackDrift = 0.0005;  // of the code range
constexpr double kUnsure = 0.003;
constexpr int kLevels = 3;
constexpr double kLowest = 0.03;  // of the code range
constexpr double kHighest = 0.85;

struct Pair {
  Frame first;
  Frame second;
  Frame black;
};

Result<Pair> take_pair(StepContext& context, const FlatLight& light, int turns) {
  Pair pair;
  auto first = context.taker.lit(light, turns, context.stop);
  if (!first) return first.error();
  auto second = context.taker.lit(light, turns, context.stop);
  if (!second) return second.error();
  auto black = context.taker.lit({0, 0, 0}, turns, context.stop);
  if (!black) return black.error();
  return Pair{*std::move(first), *std::move(second), *std::move(black)};
}

// The rates that two exposures see of the same samples, in three parts of the code range. Which part a sample belongs to is
// told by frames that do not count; a part with too few of them to tell is left out.
double rates_differ(const StepContext& context, const Pair& brief, const Pair& longer) {
  const auto linear = linear_codes(linear_camera(context));
  const auto good = good_pixels(context);
  const CodeRange range = code_range(context);
  const double width = range.clipping - range.black;
  std::array<double, kLevels> a{};
  std::array<double, kLevels> b{};
  std::array<double, kLevels> noise{};
  for (std::size_t i = 0; i < brief.first.pixels.samples().size(); ++i) {
    const double low = (brief.second.pixels.samples()[i] - range.black) / width;
    const double high = (longer.second.pixels.samples()[i] - range.black) / width;
    if (good.samples()[i / 3] == 0 || low < kLowest || high > kHighest) continue;
    const auto level = static_cast<std::size_t>(high / kHighest * (kLevels - 1e-9));
    const auto net = [&](const Pair& pair) {
      return linear[pair.first.pixels.samples()[i]] - linear[pair.black.pixels.samples()[i]];
    };
    a[level] += net(brief);
    b[level] += net(longer);
    const double difference =
        linear[brief.first.pixels.samples()[i]] - linear[brief.second.pixels.samples()[i]];
    noise[level] += difference * difference;  // of the light's and of the black's frame
  }
  const double times = seconds_of(longer.first.exposure) / seconds_of(brief.first.exposure);
  double most = 0.0;
  for (std::size_t k = 0; k < kLevels; ++k) {
    if (std::sqrt(noise[k]) < kUnsure * a[k])
      most = std::max(most, std::abs(b[k] / a[k] / times - 1.0));
  }
  return most;
}

// Mean of the squared difference of two frames alike over what gain and read noise say it is.
double noise_off(const StepContext& context, const Pair& pair) {
  const Measured& m = context.record.measured;
  capture::StationCalibration station = context.given;
  station.camera.bit_depth = context.taker.camera().bit_depth;
  const capture::CameraCalibration camera = with_measured(station, m).camera;
  const auto good = good_pixels(context);
  const CodeRange range = code_range(context);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < pair.first.pixels.samples().size(); ++i) {
    const double code = 0.5 * (pair.first.pixels.samples()[i] + pair.second.pixels.samples()[i]);
    const double f = (code - range.black) / (range.clipping - range.black);
    if (good.samples()[i / 3] == 0 || f < kLowest || f > kHighest) continue;
    const capture::Electrons e = capture::electrons_from_code(camera, code);
    const double variance = std::max(e.signal, 0.0) +
                            camera.read_noise_electrons * camera.read_noise_electrons +
                            e.per_code * e.per_code / 12.0;
    const double difference =
        e.per_code * (pair.first.pixels.samples()[i] - 1.0 * pair.second.pixels.samples()[i]);
    sum += difference * difference / (2.0 * variance);
    count += 1.0;
  }
  return std::abs(sum / count - 1.0);
}

Result<double> black_drift(StepContext& context) {
  const auto frame = context.taker.dark(milliseconds(10), context.stop);
  if (!frame) return frame.error();
  const auto good = good_pixels(context);
  std::vector<double> plain(std::size_t{1} << 16);
  for (std::size_t code = 0; code < plain.size(); ++code) plain[code] = static_cast<double>(code);
  const auto sum = sum_of(*frame, plain, good);
  const auto pixels = static_cast<double>(std::ranges::count(good.samples(), 1));
  return (sum[0] + sum[1] + sum[2]) / (3.0 * pixels) - *context.record.measured.black_level;
}

}  // namespace

Result<StepRecord> check(StepContext& context) {
  StepRecord record{"check", {}, {}, {}};
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  if (!record.accepted()) return record;
  context.progress(0.2, "two exposures not seen before");
  const int brief_turns = brightness->turns;
  const int long_turns = std::min(context.taker.most_turns(), 5 * brief_turns);
  const auto brief = take_pair(context, brightness->light, brief_turns);
  if (!brief) return brief.error();
  const auto longer = take_pair(context, brightness->light, long_turns);
  if (!longer) return longer.error();
  context.progress(0.8, "black");
  const auto drift = black_drift(context);
  if (!drift) return drift.error();
  const double highest = linear_camera(context).max_code();
  const bool curved =
      context.record.measured.response->kind != capture::ResponseCurve::Kind::kLinear;
  const double allowed = curved ? kCurved : 1.0;
  record.values = {{"black_drift_codes", *drift}};
  record.gates.push_back({"exposures disagree",
                          rates_differ(context, *brief, *longer),
                          allowed * kRatesDiffer,
                          "of the light",
                          "the light or the response has changed since: start again"});
  record.gates.push_back(
      {"noise is not as measured",
       std::max(noise_off(context, *brief), noise_off(context, *longer)),
       allowed * kNoiseOff,
       "of its variance",
       "switch off the camera's noise reduction and automatic gain, and start again"});
  record.gates.push_back({"drifted black",
                          std::abs(*drift) / (highest - *context.record.measured.black_level),
                          kBlackDrift,
                          "of the code range",
                          "the camera has warmed up, or its offset was changed: start again"});
  return record;
}

}  // namespace opaline::calibration
