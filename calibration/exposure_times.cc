#include "calibration/exposure_times.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace opaline::calibration {
namespace {

constexpr double kUnsure = 0.001;  // relative: what is told less well ends the chain
constexpr double kLowest = 0.02;   // of the code range
constexpr double kHighest = 0.85;
constexpr double kSignificant = 3.0;  // deviations
constexpr double kWorthIt = 5e-4;

// How many times as long as the exposure before it an exposure was.
struct Growth {
  double times = 0.0;
  double deviation = 1.0;  // standard, relative
};

Growth growth(std::span<const Frame> first,
              std::span<const Frame> second,
              std::size_t j,
              CodeRange range,
              std::span<const double> linear,
              const Image<std::uint8_t>& good) {
  const double low = range.black + kLowest * (range.clipping - range.black);
  const double high = range.black + kHighest * (range.clipping - range.black);
  std::array<double, 2> sum{};
  std::array<double, 2> variance{};
  for (std::size_t i = 0; i < first[j].pixels.samples().size(); ++i) {
    if (good.samples()[i / 3] == 0 || second[j - 1].pixels.samples()[i] < low ||
        second[j].pixels.samples()[i] > high)
      continue;
    for (std::size_t k = 0; k < 2; ++k) {
      const double code = linear[first[j - 1 + k].pixels.samples()[i]];
      const double difference = code - linear[second[j - 1 + k].pixels.samples()[i]];
      sum[k] += code;
      variance[k] += 0.5 * difference * difference;
    }
  }
  if (!(sum[0] > 0.0 && sum[1] > 0.0)) return {};
  return {sum[1] / sum[0],
          std::sqrt(variance[0] / (sum[0] * sum[0]) + variance[1] / (sum[1] * sum[1]))};
}

double reported(const Frame& frame) {
  return std::chrono::duration<double>(frame.exposure).count();
}

}  // namespace

ExposureTimes measure_exposures(std::span<const Frame> first,
                                std::span<const Frame> second,
                                CodeRange range,
                                std::span<const double> linear,
                                const Image<std::uint8_t>& good) {
  ExposureTimes times;
  if (first.empty()) return times;
  times.exposures.push_back({reported(first[0]), 0.0, 0.0});  // logarithms until all are known
  for (std::size_t j = 1; j < first.size(); ++j) {
    const Growth seen = growth(first, second, j, range, linear, good);
    if (seen.deviation > kUnsure) break;
    const ExposureTimes::One& before = times.exposures.back();
    const double told = reported(first[j]) / reported(first[j - 1]);
    times.exposures.push_back({reported(first[j]),
                               before.factor + std::log(seen.times / told),
                               std::hypot(before.deviation, seen.deviation)});
  }
  std::vector<ExposureTimes::One> sorted = times.exposures;
  std::ranges::sort(sorted, {}, &ExposureTimes::One::factor);
  const ExposureTimes::One middle = sorted[sorted.size() / 2];
  for (auto& one : times.exposures) {
    one.factor = std::exp(one.factor - middle.factor);
    one.deviation =
        std::sqrt(std::abs(one.deviation * one.deviation - middle.deviation * middle.deviation));
    times.largest_error = std::max(times.largest_error, std::abs(one.factor - 1.0));
  }
  return times;
}

std::vector<capture::ExposureFactor> ExposureTimes::corrections() const {
  std::vector<capture::ExposureFactor> all;
  bool any = false;
  for (const One& one : exposures) {
    const double off = std::abs(one.factor - 1.0);
    const bool told = off > kSignificant * one.deviation && off > kWorthIt;
    any = any || told;
    all.push_back({one.reported, told ? one.factor : 1.0});
  }
  if (!any) all.clear();
  return all;
}

}  // namespace opaline::calibration
