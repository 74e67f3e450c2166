#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr int kLonger = 64;            // than the exposure that white light wants
constexpr double kWellLitShare = 0.5;  // of the brightest
constexpr double kCanBeTold = 5.0;     // deviations of noise

// Linear codes a second, in the mean over the lit pixels, with the deviation of that mean.
struct Rate {
  double mean = 0.0;
  double deviation = 0.0;
};

class LitPixels {
 public:
  LitPixels(const StepContext& context, const Brightness& brightness, const Frame& white)
      : linear_(linear_codes(linear_camera(context))) {
    const double black = code_range(context).black;
    const double highest = linear_camera(context).max_code();
    const double least = black + kWellLitShare * (brightness.brightest * highest - black);
    const auto good = good_pixels(context);
    const auto codes = white.pixels.samples();
    for (std::size_t i = 0; i < codes.size(); ++i) {
      if (good.samples()[i / 3] != 0 && codes[i] >= least) lit_.push_back(i);
    }
  }
  /// Of what one frame has above another.
  Rate above(const Frame& frame, const Frame& dark) const {
    double sum = 0.0;
    double squares = 0.0;
    for (const std::size_t i : lit_) {
      const double rate = rate_of(frame, i) - rate_of(dark, i);
      sum += rate;
      squares += rate * rate;
    }
    const double n = std::max(1.0, static_cast<double>(lit_.size()));
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / n)};
  }

 private:
  double rate_of(const Frame& frame, std::size_t sample) const {
    return linear_[frame.pixels.samples()[sample]] / seconds_of(frame.exposure);
  }
  std::vector<double> linear_;
  std::vector<std::size_t> lit_;
};

}  // namespace

Result<std::optional<double>> projector_black(StepContext& context, const Brightness& brightness) {
  const double gamma = context.record.measured.projector_gamma.value_or(1.0);
  const int longer = std::min(kLonger * brightness.turns, context.taker.most_turns());
  const auto white = context.taker.lit(brightness.light, brightness.turns, context.stop);
  if (!white) return white.error();
  const auto black = context.taker.lit({0, 0, 0}, longer, context.stop);
  if (!black) return black.error();
  const auto dark = context.taker.dark(black->exposure, context.stop);
  if (!dark) return dark.error();
  const LitPixels pixels(context, brightness, *white);
  const Rate leaks = pixels.above(*black, *dark);
  const Rate light = pixels.above(*white, *black);
  if (!(leaks.mean > kCanBeTold * leaks.deviation) || !(light.mean > 0.0)) return std::nullopt;
  const double full = light.mean * std::pow(255.0 / brightness.light[0], gamma);
  return leaks.mean / (leaks.mean + full);
}

}  // namespace opaline::calibration
