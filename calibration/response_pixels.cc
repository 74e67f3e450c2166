#include "calibration/response_pixels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace opaline::calibration {
namespace {

constexpr std::size_t kMostPixels = 6000;
constexpr int kFewestPixels = 50;
constexpr double kLowest = 0.01;
constexpr double kHighest = 0.98;
constexpr double kTelling = 1.9;  // times as long: a growth that noise does not hide
constexpr double kGrowth = 1.05;  // of the code, at least, where the time doubles

// From the first sample to the first one at least twice as long: closer ones differ by less than noise and rounding may take away.
bool stuck(const std::vector<ResponseSample>& samples, std::span<const Exposure> stack) {
  std::size_t from = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double times = stack[samples[i].exposure].seconds / stack[samples[from].exposure].seconds;
    if (times < kTelling) continue;
    const double codes = samples[i].fraction / samples[from].fraction;
    if (codes < std::pow(kGrowth, std::log2(times))) return true;
    from = i;
  }
  return false;
}

std::vector<ResponseSample> samples_of(std::span<const Exposure> stack,
                                       CodeRange range,
                                       int channel,
                                       std::size_t pixel) {
  std::vector<ResponseSample> samples;
  const double lowest = lowest_fraction(range);
  for (std::size_t j = 0; j < stack.size(); ++j) {
    const Image<std::uint16_t>& frame = *stack[j].frame;
    const double code = frame.samples()[pixel * frame.channels() + channel];
    const double f = (code - range.black) / (range.clipping - range.black);
    if (f <= lowest || f >= kHighest) continue;
    samples.push_back({j, f, f * (1.0 - f), std::log(stack[j].seconds) - std::log(f)});
  }
  return samples;
}

}  // namespace

double lowest_fraction(CodeRange range) {
  return std::max(kLowest, range.floor / (range.clipping - range.black));
}

ResponsePixels collect_pixels(std::span<const Exposure> stack, CodeRange range, int channel) {
  ResponsePixels pixels;
  const std::size_t count = stack.front().frame->pixel_count();
  const std::size_t stride = std::max<std::size_t>(1, count / kMostPixels);
  for (std::size_t i = 0; i < count; i += stride) {
    ResponsePixel pixel;
    pixel.samples = samples_of(stack, range, channel, i);
    if (pixel.samples.size() < 2) continue;
    if (stuck(pixel.samples, stack)) {
      ++pixels.refused;
    } else {
      pixels.telling.push_back(std::move(pixel));
    }
  }
  return pixels;
}

Result<void> check_stack(std::span<const Exposure> stack, CodeRange range, int channel) {
  if (stack.size() < 2 || stack.size() > 64)
    return invalid_argument(
        fmt::format("a response needs 2 to 64 exposures, not {}", stack.size()));
  if (!(range.clipping > range.black + 1.0))
    return invalid_argument(
        fmt::format("pixels clip at code {} and are black at {}", range.clipping, range.black));
  const Image<std::uint16_t>& first = *stack.front().frame;
  if (channel < 0 || channel >= first.channels())
    return invalid_argument(fmt::format("no channel {} of {}", channel, first.channels()));
  for (std::size_t j = 0; j < stack.size(); ++j) {
    const Image<std::uint16_t>& frame = *stack[j].frame;
    if (frame.width() != first.width() || frame.height() != first.height() ||
        frame.channels() != first.channels())
      return invalid_argument(fmt::format("exposure {} has another size than the first", j + 1));
    const double before = j == 0 ? 0.0 : stack[j - 1].seconds;
    if (!(std::isfinite(stack[j].seconds) && stack[j].seconds > before))
      return invalid_argument(
          fmt::format("exposure {}: {} s is not longer than the one before ({} s); sort them",
                      j + 1,
                      stack[j].seconds,
                      before));
  }
  return ok();
}

Result<void> check_told(const ResponsePixels& pixels, CodeRange range) {
  if (static_cast<int>(pixels.telling.size()) < kFewestPixels)
    return invalid_argument(
        fmt::format("only {} pixels tell of the response, {} are stuck: of each pixel two "
                    "exposures must lie between 1 % "
                    "and 98 % of the codes; take exposures closer together, or another light",
                    pixels.telling.size(),
                    pixels.refused));
  if (pixels.refused > static_cast<int>(pixels.telling.size()))
    return invalid_argument(fmt::format(
        "{} of {} pixels do not grow with the exposure: the times are wrong, or the light changed",
        pixels.refused,
        pixels.refused + static_cast<int>(pixels.telling.size())));
  double lowest = 1.0;
  double highest = 0.0;
  for (const ResponsePixel& pixel : pixels.telling) {
    for (const ResponseSample& s : pixel.samples) {
      lowest = std::min(lowest, s.fraction);
      highest = std::max(highest, s.fraction);
    }
  }
  if (lowest > std::max(0.05, 1.25 * lowest_fraction(range)) || highest < 0.95)
    return invalid_argument(
        fmt::format("the stack tells of {:.0f} to {:.0f} % of the code range; 5 to 95 % are "
                    "needed: add longer and shorter exposures",
                    100.0 * lowest,
                    100.0 * highest));
  return ok();
}

}  // namespace opaline::calibration
