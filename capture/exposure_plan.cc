#include "capture/exposure_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kApart{100};

double count(nanoseconds time) { return static_cast<double>(time.count()); }

// `span` is the longest exposure over the shortest.
Error too_many(double ratio, double span) {
  const double enough = std::pow(span, 1.0 / (static_cast<double>(kMaxExposures) - 2.0));
  return invalid_argument(fmt::format(
      "capture.exposures.ratio = {}: more than {} exposures for every light; expected at least "
      "{:.2f}",
      ratio,
      kMaxExposures,
      std::ceil(enough * 100.0) / 100.0));
}

double ms(nanoseconds time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

Result<std::vector<nanoseconds>> exposure_ladder(const ExposureOptions& options,
                                                 const ExposureLimits& limits) {
  const nanoseconds shortest = std::max(options.shortest, limits.shortest);
  const nanoseconds longest = std::min(options.longest, limits.longest);
  const nanoseconds period = limits.wheel_period.count() > 0 ? limits.wheel_period : shortest;
  constexpr double kRounding = 1e-6;  // "1/30 s" in nanoseconds is a little less than a turn
  const double turns_shortest = count(shortest) / count(period);
  const double turns_longest = count(longest) / count(period);
  const auto first = std::max<std::int64_t>(1, std::llround(std::ceil(turns_shortest - kRounding)));
  const auto last = std::llround(std::floor(turns_longest + kRounding));
  if (last < first) {
    return invalid_argument(
        fmt::format("no whole turn of the colour wheel ({:.3f} ms) lies between the exposures "
                    "{:.3f} ms and {:.3f} ms that options and camera allow",
                    ms(period),
                    ms(shortest),
                    ms(longest)));
  }
  std::vector<nanoseconds> ladder;
  for (double turns = static_cast<double>(first); std::llround(turns) < last;
       turns = std::max(turns * options.ratio, turns + 1.0)) {
    ladder.push_back(period * std::llround(turns));
    if (ladder.size() == kMaxExposures)
      return too_many(options.ratio, turns_longest / static_cast<double>(first));
  }
  ladder.push_back(period * last);
  return ladder;
}

nanoseconds repeated_exposure(nanoseconds exposure, std::size_t repeat) {
  return exposure + kApart * static_cast<std::int64_t>(repeat);
}

int planned_blacks(nanoseconds exposure, std::size_t ladder_size) {
  constexpr nanoseconds kTogether = std::chrono::seconds(8);
  const auto most =
      static_cast<std::int64_t>(kMaxExposures / std::max<std::size_t>(ladder_size, 1));
  return static_cast<int>(
      std::clamp<std::int64_t>(kTogether / exposure, 1, std::clamp<std::int64_t>(most, 1, 8)));
}

bool same_exposure(nanoseconds a, nanoseconds b) {
  return std::chrono::abs(a - b) < kApart * static_cast<std::int64_t>(kMaxExposures);
}

Bracket::Bracket(const ExposureOptions& options, std::size_t ladder_size)
    : wanted_snr_(options.wanted_snr), size_(ladder_size) {}

std::optional<std::size_t> Bracket::next() const {
  if (empty_) return size_ / 2;
  if (at_lowest_.saturated_share > 0.0 && lowest_ > 0) return lowest_ - 1;
  if (at_highest_.dark_snr < wanted_snr_ && highest_ + 1 < size_) return highest_ + 1;
  return std::nullopt;
}

void Bracket::add(std::size_t index, const ExposureStatistics& statistics) {
  if (empty_ || index <= lowest_) {
    lowest_ = index;
    at_lowest_ = statistics;
  }
  if (empty_ || index >= highest_) {
    highest_ = index;
    at_highest_ = statistics;
  }
  empty_ = false;
}

}  // namespace opaline::capture
