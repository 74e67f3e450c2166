#include "calibration/sensor_noise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace opaline::calibration {
namespace {

constexpr std::size_t kBins = 32;
constexpr double kBrightest = 0.85;   // of the code range
constexpr std::size_t kFewest = 100;  // of a bin
constexpr double kDarkDeviations = 4.0;
constexpr double kLeastDark =
    4.0;  // codes: in narrower bins of whole codes the mean tells the difference
constexpr double kOutlying = 5.0;  // standard deviations
constexpr double kHot = 8.0;       // standard deviations
constexpr double kMadToSigma = 1.4826;
constexpr double kQuantisation = 1.0 / 12.0;
constexpr double kSlopeOver = 1.0 / 64;
constexpr double kResolved = 0.45;  // codes: half a code, less what it may be measured too low by

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

double deviation_about(double centre, std::vector<double> values) {
  for (double& value : values) value = std::abs(value - centre);
  return kMadToSigma * median_of(std::move(values));
}

bool same_shape(const Image<std::uint16_t>& a, const Image<std::uint16_t>& b) {
  return a.width() == b.width() && a.height() == b.height() && a.channels() == b.channels();
}

struct Bin {
  std::vector<double> means;
  std::vector<double> differences;
};

struct Level {
  double mean = 0.0;
  double variance = 0.0;
  double count = 0.0;
};

double at_middle(const FramePair& pair, std::size_t sample, double black) {
  return 0.5 * (pair.first->samples()[sample] + pair.second->samples()[sample]) - black;
}

// Up to four deviations of a pair's mean in the dark.
double end_of_dark(const FramePair& pair, CodeRange range, int channel) {
  std::vector<double> differences;
  const double dark = kBrightest * (range.clipping - range.black) / (2.0 * kBins);
  for (std::size_t i = 0; i < pair.first->pixel_count(); ++i) {
    const std::size_t sample = i * pair.first->channels() + channel;
    if (at_middle(pair, sample, range.black) >= dark) continue;
    differences.push_back(1.0 * pair.first->samples()[sample] - pair.second->samples()[sample]);
  }
  if (differences.size() < kFewest) return kLeastDark;
  return std::max(kLeastDark,
                  kDarkDeviations * 0.5 * deviation_about(median_of(differences), differences));
}

// Bins of one pair: those of two exposures would hold two noises, and the darker one would take the brighter one for outlying. So would
// wide bins near black of a picture that is mostly dark, wherefore bins widen with the light as its noise does.
std::vector<Bin> sorted_by_light(const FramePair& pair, CodeRange range, int channel) {
  std::vector<Bin> bins(kBins);
  const double dark = end_of_dark(pair, range, channel);
  const double most = kBrightest * (range.clipping - range.black);
  for (std::size_t i = 0; i < pair.first->pixel_count(); ++i) {
    const std::size_t sample = i * pair.first->channels() + channel;
    const double mean = at_middle(pair, sample, range.black);
    if (mean < -most / (2.0 * kBins) || mean >= most) continue;
    const double share = std::max(0.0, mean - dark) / (most - dark);
    const auto bin =
        mean < dark ? std::size_t{0} : 1 + static_cast<std::size_t>((kBins - 1) * std::sqrt(share));
    bins[std::min(bin, kBins - 1)].means.push_back(mean);
    bins[std::min(bin, kBins - 1)].differences.push_back(1.0 * pair.first->samples()[sample] -
                                                         pair.second->samples()[sample]);
  }
  return bins;
}

Level level_of(const Bin& bin) {
  Level level;
  const double centre = median_of(bin.differences);
  const double limit = kOutlying * std::max(deviation_about(centre, bin.differences), 1.0) + 1.0;
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < bin.means.size(); ++i) {
    if (std::abs(bin.differences[i] - centre) > limit) continue;
    level.mean += bin.means[i];
    sum += bin.differences[i];
    squares += bin.differences[i] * bin.differences[i];
    level.count += 1.0;
  }
  level.mean /= level.count;
  level.variance = 0.5 * (squares - sum * sum / level.count) / (level.count - 1.0) - kQuantisation;
  return level;
}

Level through(const capture::ResponseCurve& response, CodeRange range, Level level) {
  if (response.kind == capture::ResponseCurve::Kind::kLinear) return level;
  const double width = range.clipping - range.black;
  const double f = level.mean / width;
  const double low = std::max(0.0, f - kSlopeOver);
  const double high = std::min(1.0, f + kSlopeOver);
  const double slope = (signal_at(response, high) - signal_at(response, low)) / (high - low);
  level.mean = width * signal_at(response, f);
  level.variance *= slope * slope;
  return level;
}

struct Line {
  double slope = 0.0;
  double at_zero = 0.0;
  double slope_deviation = 0.0;
};

// Weights from the fitted variance and not the measured one, which would favour bins that came out low.
Line fit_line(const std::vector<Level>& levels) {
  Line line;
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const Level& level : levels) {
      const double expected =
          round == 0 ? std::max(level.variance, kQuantisation)
                     : std::max(line.at_zero + line.slope * level.mean, 0.0) + kQuantisation;
      const Eigen::Vector2d row(1.0, level.mean);
      const double weight = level.count / (2.0 * expected * expected);
      matrix += weight * row * row.transpose();
      right += weight * level.variance * row;
    }
    const Eigen::Matrix2d covariance = matrix.inverse();
    const Eigen::Vector2d solution = covariance * right;
    line = {solution[1], solution[0], std::sqrt(covariance(1, 1))};
  }
  return line;
}

std::vector<double> to_doubles(const Image<float>& image) {
  return {image.samples().begin(), image.samples().end()};
}

double standard_deviation(const std::vector<double>& values) {
  double sum = 0.0;
  double squares = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

// Of each sample over the frames.
struct Moments {
  Image<float> mean;
  std::vector<double> variances;
};

Moments moments_of(std::span<const Image<std::uint16_t>* const> frames) {
  const Image<std::uint16_t>& first = *frames.front();
  Moments moments{Image<float>(first.width(), first.height(), first.channels()), {}};
  const auto count = static_cast<double>(frames.size());
  for (std::size_t i = 0; i < first.samples().size(); ++i) {
    double sum = 0.0;
    double squares = 0.0;
    for (const Image<std::uint16_t>* frame : frames) {
      const double code = frame->samples()[i];
      sum += code;
      squares += code * code;
    }
    moments.mean.samples()[i] = static_cast<float>(sum / count);
    moments.variances.push_back(std::max(0.0, squares - sum * sum / count) / (count - 1.0));
  }
  return moments;
}

void mark_hot(DarkFrame& dark) {
  const std::vector<double> means = to_doubles(dark.mean);
  dark.level = median_of(means);
  const double limit = kHot * std::max(deviation_about(dark.level, means), 0.25);
  dark.hot = Image<std::uint8_t>(dark.mean.width(), dark.mean.height(), 1);
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (std::abs(means[i] - dark.level) > limit) dark.hot.samples()[i / dark.mean.channels()] = 1;
  }
}

}  // namespace

Result<PhotonTransfer> photon_transfer(std::span<const FramePair> pairs,
                                       CodeRange range,
                                       int channel,
                                       const capture::ResponseCurve& response) {
  for (const FramePair& pair : pairs) {
    if (!same_shape(*pair.first, *pair.second))
      return invalid_argument("the frames of a pair differ in size");
    if (channel < 0 || channel >= pair.first->channels())
      return invalid_argument(fmt::format("no channel {} of {}", channel, pair.first->channels()));
  }
  if (!(range.clipping > range.black + 1.0))
    return invalid_argument(
        fmt::format("pixels clip at code {} and are black at {}", range.clipping, range.black));
  std::vector<Level> levels;
  double brightest = 0.0;
  for (const FramePair& pair : pairs)
    for (const Bin& bin : sorted_by_light(pair, range, channel)) {
      if (bin.means.size() < kFewest) continue;
      levels.push_back(through(response, range, level_of(bin)));
      brightest = std::max(brightest, levels.back().mean);
    }
  if (levels.size() < 3 || brightest < 0.2 * (range.clipping - range.black))
    return invalid_argument(
        fmt::format("photon transfer needs three levels of light up to a fifth of the code range "
                    "at least; the pairs have {}",
                    levels.size()));
  const Line line = fit_line(levels);
  if (!(line.slope > 4.0 * line.slope_deviation))
    return invalid_argument(
        "the noise does not grow with the light: the pictures are processed, or the response is "
        "not linear");
  const double gain = 1.0 / line.slope;
  const bool resolved = line.at_zero > kResolved * kResolved;
  PhotonTransfer found{gain,
                       gain * (resolved ? std::sqrt(line.at_zero) : 0.5),
                       resolved,
                       line.slope_deviation * gain * gain,
                       {}};
  for (const Level& level : levels) found.levels.push_back({level.mean, level.variance});
  return found;
}

Result<DarkFrame> measure_dark(std::span<const Image<std::uint16_t>* const> frames) {
  if (frames.size() < 2)
    return invalid_argument(fmt::format("{} dark frames; at least 2 are needed", frames.size()));
  for (const Image<std::uint16_t>* frame : frames) {
    if (!same_shape(*frame, *frames.front()))
      return invalid_argument("the dark frames differ in size");
  }
  Moments moments = moments_of(frames);
  DarkFrame dark;
  dark.mean = std::move(moments.mean);
  mark_hot(dark);
  std::vector<double> cold;
  double variance = 0.0;
  for (std::size_t i = 0; i < moments.variances.size(); ++i) {
    if (dark.hot.samples()[i / dark.mean.channels()] != 0) continue;
    cold.push_back(dark.mean.samples()[i]);
    variance += moments.variances[i];
  }
  if (cold.empty()) return invalid_argument("every pixel is hot");
  variance /= static_cast<double>(cold.size());
  const double spread = standard_deviation(cold);
  dark.temporal = std::sqrt(variance);
  dark.fixed_pattern =
      std::sqrt(std::max(0.0, spread * spread - variance / static_cast<double>(frames.size())));
  return dark;
}

}  // namespace opaline::calibration
