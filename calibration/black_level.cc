#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/sensor_noise.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr int kMapSide = 32;

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr int kFrames = 6;  // of each exposure
constexpr std::array<nanoseconds, 3> kExposures{
    nanoseconds(milliseconds(10)), nanoseconds(milliseconds(500)), nanoseconds(milliseconds(4000))};
constexpr double kHotShare = 0.01;
constexpr double kClippedShare = 0.001;
constexpr double kChance = 5.0;  // deviations of a mean
constexpr double kStray = 0.01;  // of the range, in a second

struct DarkSet {
  std::vector<Frame> frames;
  DarkFrame measured;
  double seconds = 0.0;
};

Result<DarkSet> take_dark(StepContext& context, nanoseconds exposure, double done) {
  const drivers::CameraInfo& camera = context.taker.camera();
  const nanoseconds fits =
      std::clamp(exposure, camera.shortest_exposure, camera.longest_exposure * 9 / 10);
  DarkSet set;
  for (int i = 0; i < kFrames; ++i) {
    context.progress(done, fmt::format("dark for {:.3g} s", seconds_of(fits)));
    auto frame = context.taker.dark(fits, context.stop);
    if (!frame) return frame.error();
    set.seconds += seconds_of(frame->exposure) / kFrames;
    set.frames.push_back(*std::move(frame));
  }
  std::vector<const Image<std::uint16_t>*> pictures;
  for (const Frame& frame : set.frames) pictures.push_back(&frame.pixels);
  auto measured = measure_dark(pictures);
  if (!measured) return measured.error();
  set.measured = *std::move(measured);
  return set;
}

std::array<double, 3> channel_means(const Image<float>& mean, const Image<std::uint8_t>& hot) {
  std::array<double, 3> sum{};
  double count = 0.0;
  for (std::size_t i = 0; i < mean.samples().size(); ++i) {
    if (hot.samples()[i / 3] != 0) continue;
    sum[i % 3] += mean.samples()[i];
    count += 1.0 / 3.0;
  }
  for (double& s : sum) s /= count;
  return sum;
}

double share_at_zero(const Frame& frame) {
  const auto codes = frame.pixels.samples();
  return static_cast<double>(std::ranges::count(codes, 0)) / static_cast<double>(codes.size());
}

// The slope of a line through points.
double slope_through(const std::vector<double>& x, const std::vector<double>& y) {
  const double mx = mean_of(x);
  const double my = mean_of(y);
  double xy = 0.0;
  double xx = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mx) * (y[i] - my);
    xx += (x[i] - mx) * (x[i] - mx);
  }
  return xy / xx;
}

Image<std::uint8_t> hot_in_any(const std::vector<DarkSet>& sets) {
  Image<std::uint8_t> hot = sets.front().measured.hot;
  for (const DarkSet& set : sets) {
    std::ranges::transform(
        hot.samples(), set.measured.hot.samples(), hot.samples().begin(), std::bit_or<>());
  }
  return hot;
}

void keep_hot_pixels(const Image<std::uint8_t>& hot, Measured& measured) {
  measured.hot_pixels.clear();
  for (int y = 0; y < hot.height(); ++y) {
    for (int x = 0; x < hot.width(); ++x) {
      if (hot.at(x, y) != 0) measured.hot_pixels.emplace_back(x, y);
    }
  }
}

// Means over squares of the picture, at most 32 each way, less `black`: what a report draws. Hot pixels are left out.
nlohmann::json dark_map(const Image<float>& mean, const Image<std::uint8_t>& hot, double black) {
  const int side = (std::max(mean.width(), mean.height()) + kMapSide - 1) / kMapSide;
  nlohmann::json rows = nlohmann::json::array();
  for (int top = 0; top < mean.height(); top += side) {
    nlohmann::json row = nlohmann::json::array();
    for (int left = 0; left < mean.width(); left += side) {
      double sum = 0.0;
      double count = 0.0;
      for (int y = top; y < std::min(mean.height(), top + side); ++y) {
        for (int x = left; x < std::min(mean.width(), left + side); ++x) {
          if (hot.at(x, y) != 0) continue;
          sum += (mean.at(x, y, 0) + mean.at(x, y, 1) + mean.at(x, y, 2)) / 3.0 - black;
          count += 1.0;
        }
      }
      row.push_back(count > 0.0 ? sum / count : 0.0);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// Of all samples that are not hot, frame by frame.
double wander_of(const DarkSet& set, const Image<std::uint8_t>& hot) {
  std::vector<double> levels;
  for (const Frame& frame : set.frames) {
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < frame.pixels.samples().size(); ++i) {
      if (hot.samples()[i / 3] != 0) continue;
      sum += frame.pixels.samples()[i];
      count += 1.0;
    }
    levels.push_back(sum / count);
  }
  const auto [low, high] = std::ranges::minmax(levels);
  return high - low;
}

}  // namespace

Result<StepRecord> black_level(StepContext& context) {
  std::vector<DarkSet> sets;
  for (std::size_t i = 0; i < kExposures.size(); ++i) {
    auto set = take_dark(context, kExposures[i], static_cast<double>(i) / kExposures.size());
    if (!set) return set.error();
    sets.push_back(*std::move(set));
  }
  const Image<std::uint8_t> hot = hot_in_any(sets);
  const auto count = static_cast<double>(std::ranges::count(hot.samples(), 1));
  const double hot_share = count / static_cast<double>(hot.samples().size());
  Measured& m = context.record.measured;
  std::vector<double> seconds;
  seconds.reserve(sets.size());
  for (const DarkSet& set : sets) seconds.push_back(set.seconds);
  m.dark_codes_per_second = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> levels;
    levels.reserve(sets.size());
    for (const DarkSet& set : sets) levels.push_back(channel_means(set.measured.mean, hot)[c]);
    const double slope = slope_through(seconds, levels);
    m.black_of_channels[c] = levels.front() - slope * seconds.front();
    m.dark_codes_per_second += slope / 3.0;
  }
  m.black_level = mean_of(m.black_of_channels);
  keep_hot_pixels(hot, m);
  const double highest = linear_camera(context).max_code();
  const double step = highest / 4095.0;
  const auto [low, high] = std::ranges::minmax(m.black_of_channels);
  const double chance = kChance * sets.front().measured.temporal /
                        std::sqrt(static_cast<double>(hot.samples().size()));
  StepRecord record{"black_level", {}, {}, {}};
  record.values = {{"black_level", *m.black_level},
                   {"black_of_channels", m.black_of_channels},
                   {"dark_codes_per_second", m.dark_codes_per_second},
                   {"temporal_noise_codes", sets.front().measured.temporal},
                   {"fixed_pattern_codes", sets.front().measured.fixed_pattern},
                   {"hot_pixels", m.hot_pixels.size()},
                   {"dark_map", dark_map(sets.back().measured.mean, hot, *m.black_level)},
                   {"dark_map_seconds", sets.back().seconds}};
  record.gates = {
      {"hot pixels", hot_share, kHotShare, "of all pixels", "cool the camera, or replace it"},
      {"black is clipped",
       share_at_zero(sets.front().frames.front()),
       kClippedShare,
       "of samples at code 0",
       "raise the camera's offset (black level) so that noise about black is not cut off"},
      {"channels differ in the dark",
       high - low,
       step + chance,
       "codes",
       "switch off the camera's white balance and colour correction"},
      {"drifted black",
       wander_of(sets.front(), hot),
       0.5 * step + chance,
       "codes, from frame to frame",
       "let the camera warm up; switch off its automatic black level"},
      {"stray light",
       m.dark_codes_per_second / (highest - *m.black_level),
       kStray,
       "of the code range in a second",
       "darken the room; is the lamp really off?"}};
  return record;
}

}  // namespace opaline::calibration
