#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr double kLinear = 0.005;  // departure of full scale
constexpr std::size_t kBins = 18;  // each a twentieth of the code range
constexpr double kLowest = 0.05;
constexpr double kHighest = 0.95;
constexpr double kNotFull = 0.97;
constexpr double kFewest = 50.0;
constexpr double kOwnLight = 0.5;  // of another channel's light over its own
constexpr double kGammaOff = 0.05;
constexpr double kCurveOff = 0.02;    // rms, relative
constexpr double kPlateau = 1.02;     // growth while the time doubles
constexpr double kPlateauFrom = 0.2;  // of the code range
constexpr double kAlmostAll = 0.98;
constexpr std::size_t kPlateauPixels = 20;
constexpr std::array<double, 5> kLevels{1.0, 0.8, 0.6, 0.4, 0.25};
constexpr std::array<std::string_view, 3> kColours{"red", "green", "blue"};

// The code at which pixels no longer grow with the time, where that is below the highest.
double clipping_of(const Stack& stack, double black, double highest) {
  if (stack.first.size() < 2) return highest;
  const auto before = (stack.first.end() - 2)->pixels.samples();
  const auto last = stack.first.back().pixels.samples();
  std::vector<double> plateau;
  for (std::size_t i = 0; i < last.size(); ++i) {
    const double a = before[i] - black;
    const double b = last[i] - black;
    if (b > kPlateauFrom * (highest - black) && b < kPlateau * a) plateau.push_back(last[i]);
  }
  if (plateau.size() < kPlateauPixels) return highest;
  const auto middle = plateau.begin() + static_cast<std::ptrdiff_t>(plateau.size() / 2);
  std::ranges::nth_element(plateau, middle);
  return *middle > kAlmostAll * highest ? highest : *middle;
}

// The most by which codes depart from a line through black, as a share of the code range: each sample's light is told by all
// its exposures together, and what each of them is off is averaged over all samples that should have about the same code.
double departure_of(const Stack& stack, CodeRange range, const Image<std::uint8_t>& good) {
  const double width = range.clipping - range.black;
  const std::vector<double> seconds = stack.seconds();
  std::array<double, kBins> off{};
  std::array<double, kBins> count{};
  for (std::size_t i = 0; i < stack.first.front().pixels.samples().size(); ++i) {
    if (good.samples()[i / 3] == 0) continue;
    double sum = 0.0;
    double time = 0.0;
    std::size_t used = 0;
    for (; used < seconds.size(); ++used) {
      const double f = (stack.first[used].pixels.samples()[i] - range.black) / width;
      if (f > kNotFull) break;
      sum += f;
      time += seconds[used];
    }
    for (std::size_t j = 0; used > 1 && j < used; ++j) {
      const double expected = sum / time * seconds[j];
      if (expected < kLowest || expected >= kHighest) continue;
      const auto bin =
          static_cast<std::size_t>(kBins * (expected - kLowest) / (kHighest - kLowest));
      off[bin] += (stack.first[j].pixels.samples()[i] - range.black) / width - expected;
      count[bin] += 1.0;
    }
  }
  double most = 0.0;
  for (std::size_t b = 0; b < kBins; ++b) {
    if (count[b] >= kFewest) most = std::max(most, std::abs(off[b] / count[b]));
  }
  return most;
}

// Mean light of each camera channel in linear codes per second, above that of the black pattern, over pixels that are at least
// half as bright in some channel as the brightest: others tell of noise, and through a curve that is not without bias.
class Photometer {
 public:
  static Result<Photometer> create(StepContext& context, const Brightness& brightness) {
    const auto white = context.taker.lit(brightness.light, brightness.turns, context.stop);
    if (!white) return white.error();
    const CodeRange range = code_range(context);
    const double highest = linear_camera(context).max_code();
    const double least = range.black + 0.5 * (brightness.brightest * highest - range.black);
    Photometer photometer(context);
    for (std::size_t i = 0; i < photometer.bright_.samples().size(); ++i) {
      const auto brightest = std::ranges::max(white->pixels.samples().subspan(3 * i, 3));
      if (brightest < least) photometer.bright_.samples()[i] = 0;
    }
    photometer.pixels_ = static_cast<double>(std::ranges::count(photometer.bright_.samples(), 1));
    return photometer;
  }

  Result<std::array<double, 3>> measure(const FlatLight& light, int turns) {
    auto lit = rates(light, turns);
    if (!lit) return lit;
    auto dark = rates({0, 0, 0}, turns);
    if (!dark) return dark;
    for (std::size_t c = 0; c < 3; ++c) (*lit)[c] -= (*dark)[c];
    return lit;
  }

 private:
  Result<std::array<double, 3>> rates(const FlatLight& light, int turns) {
    const auto frame = context_.taker.lit(light, turns, context_.stop);
    if (!frame) return frame.error();
    std::array<double, 3> rates = sum_of(*frame, linear_, bright_);
    for (double& r : rates) r /= pixels_ * seconds_of(frame->exposure);
    return rates;
  }
  explicit Photometer(StepContext& context)
      : context_(context),
        bright_(good_pixels(context)),
        linear_(linear_codes(linear_camera(context))) {}
  StepContext& context_;
  Image<std::uint8_t> bright_;
  std::vector<double> linear_;
  double pixels_ = 1.0;
};

Result<Gate> check_channels(StepContext& context,
                            Photometer& photometer,
                            const Brightness& brightness,
                            StepRecord& record) {
  double most = 0.0;
  std::string says = "set the camera's channel order (RGB, not BGR) in its driver";
  nlohmann::json matrix = nlohmann::json::array();
  for (std::size_t p = 0; p < 3; ++p) {
    context.progress(0.5 + 0.1 * static_cast<double>(p), fmt::format("{} alone", kColours[p]));
    FlatLight light{0, 0, 0};
    light[p] = brightness.light[p];
    const auto seen = photometer.measure(light, brightness.turns);
    if (!seen) return seen.error();
    matrix.push_back(*seen);
    const auto brightest = std::ranges::max_element(*seen) - seen->begin();
    for (std::size_t c = 0; c < 3; ++c) {
      if (c != p) most = std::max(most, std::abs((*seen)[c]) / std::max((*seen)[p], 1e-9));
    }
    if (static_cast<std::size_t>(brightest) != p) {
      says = fmt::format("the projector's {} is seen by the camera's {}: {}",
                         kColours[p],
                         kColours[static_cast<std::size_t>(brightest)],
                         "set the channel order (RGB, not BGR) in the driver");
    }
  }
  record.values["channels_codes_per_second"] = std::move(matrix);
  return Gate{"swapped channels", std::min(most, 1e6), kOwnLight, "of its own light", says};
}

struct Gamma {
  double value = 0.0;
  double residual = 0.0;
};

// Light above that of code 0 goes with (code / 255)^gamma: a line in logarithms, one offset for each channel.
Gamma gamma_of(const std::vector<double>& codes, const std::vector<std::array<double, 3>>& rates) {
  double xx = 0.0;
  double xy = 0.0;
  std::vector<std::array<double, 2>> points;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> x;
    std::vector<double> y;
    for (std::size_t k = 0; k < codes.size(); ++k) {
      x.push_back(std::log(codes[k]));
      y.push_back(std::log(std::max(rates[k][c], 1e-9)));
    }
    const double mx = mean_of(x);
    const double my = mean_of(y);
    for (std::size_t k = 0; k < codes.size(); ++k) {
      points.push_back({x[k] - mx, y[k] - my});
      xx += (x[k] - mx) * (x[k] - mx);
      xy += (x[k] - mx) * (y[k] - my);
    }
  }
  Gamma gamma{xy / xx, 0.0};
  for (const auto& [x, y] : points) {
    const double off = y - gamma.value * x;
    gamma.residual += off * off / static_cast<double>(points.size());
  }
  gamma.residual = std::sqrt(gamma.residual);
  return gamma;
}

Result<Gamma> measure_gamma(StepContext& context,
                            Photometer& photometer,
                            const Brightness& brightness) {
  std::vector<double> codes;
  std::vector<std::array<double, 3>> rates;
  for (const double level : kLevels) {
    const auto code = static_cast<std::uint8_t>(std::lround(level * brightness.light[0]));
    context.progress(0.8, fmt::format("code {}", code));
    const int turns =
        std::min(static_cast<int>(brightness.turns / level), context.taker.most_turns());
    const auto rate = photometer.measure({code, code, code}, turns);
    if (!rate) return rate.error();
    codes.push_back(code);
    rates.push_back(*rate);
  }
  return gamma_of(codes, rates);
}

void note_response(StepContext& context,
                   const Stack& stack,
                   const std::vector<ResponseFit>& fits,
                   StepRecord& record) {
  const double departure = departure_of(stack, code_range(context), good_pixels(context));
  const bool linear = departure <= kLinear;
  context.record.measured.response =
      linear ? capture::ResponseCurve{} : fits[1].curve;  // green, until radiometric
  record.values["departure_from_line"] = departure;
  record.values["curve"] = fits[1].curve.table;
  record.values["linear"] = linear;
}

}  // namespace

Result<StepRecord> linearity(StepContext& context) {
  StepRecord record{"linearity", {}, {}, {}};
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  if (!record.accepted()) return record;
  context.record.measured.response.reset();
  context.record.measured.clipping_code.reset();
  const auto dim = find_dim_light(context);
  if (!dim) return dim.error();
  const auto stack = take_stack(context, *dim, 2.0, false);
  if (!stack) return stack.error();
  const double highest = linear_camera(context).max_code();
  Measured& m = context.record.measured;
  m.clipping_code = clipping_of(*stack, *m.black_level, highest);
  record.values["clipping_code"] = *m.clipping_code;
  const auto fits = fit_channels(context, *stack);
  if (!fits) {
    record.gates.push_back({"response cannot be told", 2.0, 1.0, "", fits.error().message});
    return record;
  }
  note_response(context, *stack, *fits, record);
  if (!context.record.measured.response->table.empty())
    record.gates.push_back({"pixels fill below the highest code",
                            highest / *m.clipping_code,
                            1.001,
                            "the highest code over the one at which pixels are full",
                            "lower the gain until pixels are full at the highest code: a response "
                            "that is not linear can be told only then"});
  if (!record.accepted()) return record;
  auto photometer = Photometer::create(context, *brightness);
  if (!photometer) return photometer.error();
  const auto channels = check_channels(context, *photometer, *brightness, record);
  if (!channels) return channels.error();
  record.gates.push_back(*channels);
  const auto gamma = measure_gamma(context, *photometer, *brightness);
  if (!gamma) return gamma.error();
  m.projector_gamma = gamma->value;
  record.values["projector_gamma"] = gamma->value;
  context.progress(0.9, "black");
  const auto black = projector_black(context, *brightness);
  if (!black) return black.error();
  m.projector_black = *black;
  if (*black) record.values["projector_black"] = **black;
  const double given = context.given.projector.gamma;
  record.gates.push_back(
      {"projector gamma",
       std::abs(gamma->value - given),
       kGammaOff,
       fmt::format("off the {:.3g} of the rig file", given),
       fmt::format("measured {:.3f}: switch the projector's gamma correction off, or write "
                   "calibration.projector.gamma = {:.3f} into the rig file",
                   gamma->value,
                   gamma->value)});
  record.gates.push_back({"projector curve is no power",
                          gamma->residual,
                          kCurveOff,
                          "rms, relative",
                          "switch off the projector's picture modes (dynamic contrast, eco)"});
  return record;
}

}  // namespace opaline::calibration
