#include "capture/exposure_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "capture/cholesky.h"

namespace opaline::capture {
namespace {

constexpr int kTile = 16;
constexpr double kFewestSamples = 200.0;
constexpr double kFewestInTile = 64.0;
constexpr double kAboveNoise = 3.0;  // deviations of a sample of the shorter exposure
constexpr double kClearOfClipping =
    4.0;  // deviations of every sample; twice as many, of the mean around it
constexpr double kStandsOut = 6.0;  // deviations of a tile
constexpr double kDarkest = 0.1;    // of a tile's light, for a logarithm
constexpr double kWild = 6.0;       // deviations
constexpr std::size_t kChannels = 3;
constexpr std::size_t kNumbers = 2 * kChannels + 2;  // g and h of each channel, dx, dy
constexpr std::size_t kShiftX = 2 * kChannels;
constexpr std::size_t kShiftY = kShiftX + 1;
// What is thought beforehand, so that what pixels do not tell stays near 0: deviations of g, h, and of dx, dy in px.
constexpr double kLightBefore = 1.0;
constexpr double kExponentBefore = 0.1;
constexpr double kShiftBefore = 20.0;

using Matrix = std::vector<double>;  // kNumbers x kNumbers, row-major

Matrix inverse_of(const Matrix& a) {
  Matrix inverse(kNumbers * kNumbers);
  for (std::size_t j = 0; j < kNumbers; ++j) {
    std::vector<double> unit(kNumbers);
    unit[j] = 1.0;
    Matrix factors = a;
    const std::vector<double> column = solve_cholesky(factors, std::move(unit));
    for (std::size_t i = 0; i < kNumbers; ++i) inverse[i * kNumbers + j] = column[i];
  }
  return inverse;
}

/// Weighted sums of one channel over some pixels, b being light around, l = b ln(b / full scale), d what differs.
struct ChannelSums {
  double samples = 0.0;
  double bb = 0.0, bl = 0.0, ll = 0.0, bd = 0.0, ld = 0.0;
  double inverse_signal = 0.0;
};

}  // namespace

struct ExposureComparer::Sums {
  Sums(int width, int height)
      : across((width + kTile - 1) / kTile),
        tiles(static_cast<std::size_t>(across) * ((height + kTile - 1) / kTile)),
        normal(kNumbers * kNumbers),
        right(kNumbers) {}
  int across;
  std::vector<std::array<ChannelSums, kChannels>> tiles;
  std::array<ChannelSums, kChannels> all{};
  Matrix normal;
  std::vector<double> right;
  double weight = 0.0;

  void add(const Sample& s, double logarithm, std::size_t tile, std::size_t c) {
    const double l = s.around * logarithm;
    const std::array<double, 4> terms{s.around, l, s.slope_x, s.slope_y};
    const std::array<std::size_t, 4> place{2 * c, 2 * c + 1, kShiftX, kShiftY};
    for (std::size_t i = 0; i < 4; ++i) {
      right[place[i]] += s.weight * terms[i] * s.difference;
      for (std::size_t j = 0; j < 4; ++j)
        normal[place[i] * kNumbers + place[j]] += s.weight * terms[i] * terms[j];
    }
    for (ChannelSums* sums : {&all[c], &tiles[tile][c]}) {
      sums->samples += 1.0;
      sums->bb += s.weight * s.around * s.around;
      sums->bl += s.weight * s.around * l;
      sums->ll += s.weight * l * l;
      sums->bd += s.weight * s.around * s.difference;
      sums->ld += s.weight * l * s.difference;
      sums->inverse_signal += s.weight * s.around * s.around / s.signal;
    }
    weight += s.weight * s.around * s.around;
  }
};

struct ExposureComparer::Fit {
  explicit Fit(const Sums& of) : sums(of) {
    Matrix a = sums.normal;
    const auto believe = [&](std::size_t i, double deviation) {
      a[i * kNumbers + i] += 1.0 / (deviation * deviation);
    };
    for (std::size_t c = 0; c < kChannels; ++c) {
      believe(2 * c, kLightBefore);
      believe(2 * c + 1, kExponentBefore);
    }
    believe(kShiftX, kShiftBefore);
    believe(kShiftY, kShiftBefore);
    covariance = inverse_of(a);
    numbers = solve_cholesky(a, sums.right);
  }
  double variance(std::size_t i, std::size_t j) const { return covariance[i * kNumbers + j]; }

  /// Of the channel's light as a whole: g + h m, with m the mean logarithm of its level.
  ExposureComparison::Figure light(std::size_t c) const {
    const double m = sums.all[c].bl / sums.all[c].bb;
    const std::size_t g = 2 * c;
    const double v = variance(g, g) + 2.0 * m * variance(g, g + 1) + m * m * variance(g + 1, g + 1);
    return {numbers[g] + m * numbers[g + 1], std::sqrt(v)};
  }
  /// Of the channel whose levels disagree most.
  ExposureComparison::Figure levels() const {
    ExposureComparison::Figure most;
    for (std::size_t c = 0; c < kChannels; ++c) {
      const ChannelSums& s = sums.all[c];
      if (s.samples < kFewestSamples) continue;
      const double m = s.bl / s.bb;
      const double spread = std::sqrt(std::max(0.0, s.ll / s.bb - m * m));
      const std::size_t h = 2 * c + 1;
      const ExposureComparison::Figure own{spread * std::abs(numbers[h]),
                                           spread * std::sqrt(variance(h, h))};
      if (own.value > most.value) most = own;
    }
    return most;
  }
  /// RMS over the light of dx db/dx + dy db/dy. Its deviation is along the shift.
  ExposureComparison::Figure shift() const {
    const double dx = numbers[kShiftX];
    const double dy = numbers[kShiftY];
    const double squares = dx * dx * sums.normal[kShiftX * kNumbers + kShiftX] +
                           2.0 * dx * dy * sums.normal[kShiftX * kNumbers + kShiftY] +
                           dy * dy * sums.normal[kShiftY * kNumbers + kShiftY];
    const double length = std::hypot(dx, dy);
    if (!(length > 0.0) || !(squares > 0.0)) return {};
    const double along =
        (dx * dx * variance(kShiftX, kShiftX) + 2.0 * dx * dy * variance(kShiftX, kShiftY) +
         dy * dy * variance(kShiftY, kShiftY)) /
        (length * length);
    const double changed = std::sqrt(squares / sums.weight);
    return {changed, changed / length * std::sqrt(along)};
  }
  /// The tiles that stand out of their noise.
  std::vector<ExposureComparison::Part> parts() const {
    std::vector<ExposureComparison::Part> found;
    for (std::size_t t = 0; t < sums.tiles.size(); ++t) {
      double left = 0.0;
      double squares = 0.0;
      double samples = 0.0;
      double inverse_signal = 0.0;
      for (std::size_t c = 0; c < kChannels; ++c) {
        const ChannelSums& s = sums.tiles[t][c];
        left += s.bd - numbers[2 * c] * s.bb - numbers[2 * c + 1] * s.bl;
        squares += s.bb;
        samples += s.samples;
        inverse_signal += s.inverse_signal;
      }
      if (samples < kFewestInTile || std::abs(left) < kStandsOut * std::sqrt(squares)) continue;
      const int tile = static_cast<int>(t);
      found.push_back({{left / squares, 1.0 / std::sqrt(squares)},
                       tile % sums.across * kTile + kTile / 2,
                       tile / sums.across * kTile + kTile / 2,
                       inverse_signal / squares});
    }
    return found;
  }

  const Sums& sums;
  Matrix covariance;
  std::vector<double> numbers;
};

bool ExposureComparison::Figure::exceeds(double limit, double deviations) const {
  return std::abs(value) > limit && std::abs(value) > deviations * deviation;
}

ExposureComparer::ExposureComparer(const CameraCalibration& camera)
    : camera_(camera),
      electrons_(electrons_by_code(camera)),
      clipping_electrons_(electrons_from_code(camera, clipping_code(camera)).signal) {}

std::optional<ExposureComparer::Sample> ExposureComparer::sample_at(
    const ExposurePair& shorter,
    const ExposurePair& longer,
    const Image<std::uint8_t>& footprint,
    int x,
    int y,
    int channel,
    const Rates& tile) const {
  const int width = footprint.width();
  const auto place = [&](int u, int v) {
    return 3 * (static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)) +
           static_cast<std::size_t>(channel);
  };
  std::array<std::array<double, 3>, 3> light{};  // of the longer exposure, electrons
  double raw = 0.0;                              // the same with what leaks, mean of the eight
  for (int v = 0; v < 3; ++v) {
    for (int u = 0; u < 3; ++u) {
      const int px = x + u - 1;
      const int py = y + v - 1;
      const std::uint16_t code = longer.light->at(px, py, channel);
      const double with_leak = electrons_[code].signal;
      const double deviation =
          std::sqrt(noise_variance(camera_, with_leak, electrons_[code].per_code));
      if (footprint.at(px, py) == 0 ||
          with_leak + kClearOfClipping * deviation > clipping_electrons_)
        return std::nullopt;
      const double black = black_of(longer, place(px, py), electrons_).electrons.signal;
      light[v][u] = with_leak - black * longer.light_seconds / longer.black_seconds;
      if (u != 1 || v != 1) raw += with_leak / 8.0;
    }
  }
  const Electrons& own = electrons_[longer.light->at(x, y, channel)];
  if (raw + 2.0 * kClearOfClipping * std::sqrt(noise_variance(camera_, raw, own.per_code)) >
      clipping_electrons_)
    return std::nullopt;

  const Electrons& brief = electrons_[shorter.light->at(x, y, channel)];
  const auto [brief_black, brief_blacks] = black_of(shorter, place(x, y), electrons_);
  const double blacks = black_of(longer, place(x, y), electrons_).frames;
  const double around = (light[0][0] + light[0][1] + light[0][2] + light[1][0] + light[1][2] +
                         light[2][0] + light[2][1] + light[2][2]) /
                        8.0 / longer.light_seconds;
  // Of a rate: noise of a frame and of its black. By the neighbours' light and the tile's leak: with its own a weight would follow its noise.
  const auto variance_of = [&](const ExposurePair& pair, double rate, double frames) {
    const double t = pair.light_seconds;
    const double scale = t / pair.black_seconds;
    return (noise_variance(camera_, (rate + tile.leak) * t, own.per_code) +
            scale * scale * noise_variance(camera_, tile.leak * pair.black_seconds, own.per_code) /
                frames) /
           (t * t);
  };
  if (tile.light < kAboveNoise * std::sqrt(variance_of(shorter, tile.light, brief_blacks)))
    return std::nullopt;
  const double variance =
      variance_of(shorter, around, brief_blacks) + variance_of(longer, around, blacks);
  const double brief_rate =
      (brief.signal - brief_black.signal * shorter.light_seconds / shorter.black_seconds) /
      shorter.light_seconds;
  const double most = kWild * std::sqrt(variance) + std::max(around, tile.light);
  Sample sample;
  sample.difference = std::clamp(brief_rate - light[1][1] / longer.light_seconds, -most, most);
  sample.around = around;
  const double eighth = 0.125 / longer.light_seconds;
  const auto row = [&](int v) { return light[v][2] - light[v][0]; };
  const auto column = [&](int u) { return light[2][u] - light[0][u]; };
  sample.slope_x = eighth * (row(0) + 2.0 * row(1) + row(2));
  sample.slope_y = eighth * (column(0) + 2.0 * column(1) + column(2));
  sample.weight = 1.0 / variance;
  sample.level = std::max(around, kDarkest * tile.light) * longer.light_seconds /
                 camera_.full_scale_electrons();
  sample.signal = tile.light * shorter.light_seconds / camera_.full_scale_electrons();
  return sample;
}

// Clipped pixels count as what they clip at.
std::vector<std::array<ExposureComparer::Rates, 3>> ExposureComparer::tile_rates(
    const ExposurePair& longer, const Image<std::uint8_t>& footprint) const {
  const int across = (footprint.width() + kTile - 1) / kTile;
  const int down = (footprint.height() + kTile - 1) / kTile;
  std::vector<std::array<Rates, 3>> rates(static_cast<std::size_t>(across) * down);
  std::vector<double> pixels(rates.size());
  std::size_t place = 0;
  for (int y = 0; y < footprint.height(); ++y) {
    for (int x = 0; x < footprint.width(); ++x, ++place) {
      if (footprint.at(x, y) == 0) continue;
      const auto tile = static_cast<std::size_t>(y / kTile * across + x / kTile);
      pixels[tile] += 1.0;
      for (std::size_t c = 0; c < kChannels; ++c) {
        const std::size_t sample = kChannels * place + c;
        const double light = electrons_[longer.light->samples()[sample]].signal;
        const double black = black_of(longer, sample, electrons_).electrons.signal;
        const double net = light - black * longer.light_seconds / longer.black_seconds;
        Rates& mean = rates[tile][c];
        mean.light += (net / longer.light_seconds - mean.light) / pixels[tile];
        mean.leak += (std::max(black, 0.0) / longer.black_seconds - mean.leak) / pixels[tile];
      }
    }
  }
  return rates;
}

ExposureComparer::Sums ExposureComparer::sums_of(const ExposurePair& shorter,
                                                 const ExposurePair& longer,
                                                 const Image<std::uint8_t>& footprint) const {
  Sums sums(footprint.width(), footprint.height());
  const auto rates = tile_rates(longer, footprint);
  for (int y = 1; y + 1 < footprint.height(); ++y) {
    for (int x = 1; x + 1 < footprint.width(); ++x) {
      if (footprint.at(x, y) == 0) continue;
      const auto tile = static_cast<std::size_t>(y / kTile * sums.across + x / kTile);
      for (int c = 0; c < 3; ++c) {
        const Rates& rate = rates[tile][static_cast<std::size_t>(c)];
        if (const auto s = sample_at(shorter, longer, footprint, x, y, c, rate))
          sums.add(*s, std::log(s->level), tile, static_cast<std::size_t>(c));
      }
    }
  }
  return sums;
}

std::optional<ExposureComparison> ExposureComparer::compare(
    const ExposurePair& shorter,
    const ExposurePair& longer,
    const Image<std::uint8_t>& footprint) const {
  const Sums sums = sums_of(shorter, longer, footprint);
  const auto enough = [](const ChannelSums& s) { return s.samples >= kFewestSamples; };
  if (std::ranges::none_of(sums.all, enough)) return std::nullopt;
  const Fit fit(sums);
  ExposureComparison found;
  for (std::size_t c = 0; c < kChannels; ++c)
    if (enough(sums.all[c])) found.light[c] = fit.light(c);
  found.levels = fit.levels();
  found.shift = fit.shift();
  found.shift_px = std::hypot(fit.numbers[kShiftX], fit.numbers[kShiftY]);
  found.parts = fit.parts();
  for (const ChannelSums& channel : sums.all)
    found.inverse_signal += channel.inverse_signal / sums.weight;
  return found;
}

}  // namespace opaline::capture
