#include "calibration/step.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace opaline::calibration {
namespace {

constexpr std::array<std::uint8_t, 8> kDimmer{255, 192, 144, 108, 80, 60, 45, 34};
constexpr double kFull = 0.95;  // of the highest code
constexpr double kClipped = 0.99;
constexpr double kWellLit = 0.30;
constexpr double kNextToNothing = 0.05;
constexpr double kCounts = 0.999;  // of samples; the rest may be hot
constexpr double kLit = 0.2;
constexpr double kMost = 0.8;
constexpr double kDim = 0.08;
constexpr double kStandsOut = 5.0;  // deviations of noise in the dark
constexpr int kMostExposures = 40;

double quantile_of(std::span<const std::uint16_t> codes, double share) {
  std::vector<std::uint16_t> sorted(codes.begin(), codes.end());
  const auto place =
      sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
  std::ranges::nth_element(sorted, place);
  return *place;
}

bool mostly_full(const Image<std::uint16_t>& picture, double highest) {
  std::array<double, 3> lit{};
  std::array<double, 3> full{};
  for (std::size_t i = 0; i < picture.samples().size(); ++i) {
    const std::uint16_t code = picture.samples()[i];
    if (code >= kLit * highest) lit[i % 3] += 1.0;
    if (code >= kClipped * highest) full[i % 3] += 1.0;
  }
  bool all = true;
  for (std::size_t c = 0; c < 3; ++c) all = all && lit[c] > 0.0 && full[c] >= kMost * lit[c];
  return all;
}

std::vector<std::size_t> lit_pixels(const Stack& stack,
                                    CodeRange range,
                                    const Image<std::uint8_t>& good) {
  const auto codes = stack.first.back().pixels.samples();
  const double least = range.black + kLit * (range.clipping - range.black);
  std::vector<std::size_t> lit;
  for (std::size_t i = 0; i < good.samples().size(); ++i) {
    const auto brightest = std::ranges::max(codes.subspan(3 * i, 3));
    if (good.samples()[i] != 0 && brightest >= least) lit.push_back(i);
  }
  return lit;
}

// A row of some pixels of a picture.
Image<std::uint16_t> gathered(const Image<std::uint16_t>& picture,
                              const std::vector<std::size_t>& pixels) {
  Image<std::uint16_t> row(static_cast<int>(pixels.size()), 1, 3);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      row.samples()[3 * i + c] = picture.samples()[3 * pixels[i] + c];
  }
  return row;
}

}  // namespace

void StepContext::progress(double fraction, std::string_view doing) const {
  events.progress({std::string(step), fraction, std::nullopt, {{"doing", std::string(doing)}}});
}

double seconds_of(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

double mean_of(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

double relative_deviation(std::span<const double> values) {
  const double mean = mean_of(values);
  double squares = 0.0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1)) / mean;
}

capture::CameraCalibration linear_camera(const StepContext& context) {
  const Measured& m = context.record.measured;
  capture::CameraCalibration camera;
  camera.bit_depth = context.taker.camera().bit_depth;
  camera.black_level = m.black_level.value_or(0.0);
  camera.gain_electrons_per_code = 1.0;
  if (m.response) camera.response = *m.response;
  return camera;
}

std::vector<double> linear_codes(const capture::CameraCalibration& camera) {
  std::vector<double> linear(std::size_t{1} << 16);
  const auto last = static_cast<std::size_t>(camera.max_code());
  for (std::size_t code = 0; code < linear.size(); ++code) {
    linear[code] =
        capture::electrons_from_code(camera, static_cast<double>(std::min(code, last))).signal;
  }
  return linear;
}

CodeRange code_range(const StepContext& context) {
  const Measured& m = context.record.measured;
  const double highest = linear_camera(context).max_code();
  const StepRecord* const dark = context.record.find("black_level");
  const double noise = dark == nullptr ? 0.0 : dark->values.value("temporal_noise_codes", 0.0);
  return {m.black_level.value_or(0.0), m.clipping_code.value_or(highest), kStandsOut * noise};
}

Image<std::uint8_t> good_pixels(const StepContext& context) {
  const drivers::CameraInfo& camera = context.taker.camera();
  Image<std::uint8_t> good(camera.width, camera.height, 1, 1);
  for (const auto& [x, y] : context.record.measured.hot_pixels) good.at(x, y) = 0;
  return good;
}

std::array<double, 3> sum_of(const Frame& frame,
                             std::span<const double> linear,
                             const Image<std::uint8_t>& good) {
  std::array<double, 3> sum{};
  const auto codes = frame.pixels.samples();
  for (std::size_t i = 0; i < codes.size(); ++i) {
    if (good.samples()[i / 3] != 0) sum[i % 3] += linear[codes[i]];
  }
  return sum;
}

Result<Brightness> find_brightness(StepContext& context) {
  const double highest = linear_camera(context).max_code();
  Brightness found;
  found.turns = context.taker.least_turns();
  std::size_t dimmer = 0;
  for (;;) {
    const std::uint8_t code = kDimmer[dimmer];
    found.light = {code, code, code};
    auto frame = context.taker.lit(found.light, found.turns, context.stop);
    if (!frame) return frame.error();
    found.brightest = quantile_of(frame->pixels.samples(), kCounts) / highest;
    if (found.brightest >= kFull) {
      found.saturated = dimmer + 1 == kDimmer.size();
      if (found.saturated) return found;
      ++dimmer;
      continue;
    }
    const bool longest = 2 * found.turns > context.taker.most_turns();
    if (dimmer > 0 || found.brightest >= kWellLit || longest) {
      found.dark = longest && found.brightest < kNextToNothing;
      return found;
    }
    found.turns *= 2;
  }
}

std::vector<Gate> brightness_gates(const Brightness& brightness) {
  return {{"saturated at the dimmest light",
           brightness.saturated ? 2.0 : 0.0,
           1.0,
           "",
           "close the aperture, or take a denser filter or a darker scene"},
          {"no light",
           brightness.dark ? 2.0 : 0.0,
           1.0,
           "",
           "switch the lamp on, take the lens cap off, or open the aperture"}};
}

Result<std::vector<ResponseFit>> fit_channels(const StepContext& context, const Stack& stack) {
  const CodeRange range = code_range(context);
  const std::vector<std::size_t> lit = lit_pixels(stack, range, good_pixels(context));
  if (lit.empty()) return invalid_argument("no pixel is lit to a fifth of the code range");
  std::vector<Image<std::uint16_t>> pictures;
  for (const Frame& frame : stack.first) pictures.push_back(gathered(frame.pixels, lit));
  std::vector<Exposure> exposures;
  const std::vector<double> seconds = stack.seconds();
  for (std::size_t j = 0; j < pictures.size(); ++j) exposures.push_back({&pictures[j], seconds[j]});
  std::vector<ResponseFit> fits;
  for (int c = 0; c < 3; ++c) {
    auto fit = fit_response(exposures, range, c);
    if (!fit) return fit.error();
    fits.push_back(*std::move(fit));
  }
  return fits;
}

std::vector<double> Stack::seconds() const {
  std::vector<double> all;
  for (const Frame& frame : first) all.push_back(seconds_of(frame.exposure));
  return all;
}

Result<Brightness> find_dim_light(StepContext& context) {
  const double highest = linear_camera(context).max_code();
  const double black = context.record.measured.black_level.value_or(0.0) / highest;
  const auto brightest = [&](std::size_t dimmer, int turns) -> Result<double> {
    const std::uint8_t code = kDimmer[dimmer];
    auto frame = context.taker.lit({code, code, code}, turns, context.stop);
    if (!frame) return frame.error();
    return quantile_of(frame->pixels.samples(), kCounts) / highest;
  };
  Brightness found;
  found.turns = context.taker.least_turns();
  std::size_t dimmer = 0;
  for (;; ++dimmer) {
    const auto now = brightest(dimmer, found.turns);
    if (!now) return now.error();
    found.brightest = *now;
    if (*now <= black + kDim || dimmer + 1 == kDimmer.size()) break;
  }
  for (; dimmer > 0; --dimmer) {  // and fills pixels in the longest
    const auto longest = brightest(dimmer, context.taker.most_turns());
    if (!longest) return longest.error();
    if (*longest >= kClipped) break;
  }
  const std::uint8_t code = kDimmer[dimmer];
  found.light = {code, code, code};
  return found;
}

Result<Stack> take_stack(StepContext& context, const Brightness& from, double ratio, bool pairs) {
  Stack stack;
  const int most = context.taker.most_turns();
  const double highest = linear_camera(context).max_code();
  int turns = context.taker.least_turns();
  for (int exposure = 0; exposure < kMostExposures; ++exposure) {
    context.progress(std::min(1.0, exposure / 12.0), fmt::format("exposure {}", exposure + 1));
    for (std::vector<Frame>* frames : {&stack.first, &stack.second}) {
      if (frames == &stack.second && !pairs) continue;
      auto frame = context.taker.lit(from.light, turns, context.stop);
      if (!frame) return frame.error();
      frames->push_back(*std::move(frame));
    }
    if (mostly_full(stack.first.back().pixels, highest) || turns >= most) break;
    turns = std::min(most, std::max(turns + 1, static_cast<int>(std::lround(turns * ratio))));
  }
  return stack;
}

}  // namespace opaline::calibration
