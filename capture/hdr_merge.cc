#include "capture/hdr_merge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/ensure.h"
#include "capture/told_black.h"

namespace opaline::capture {
namespace {

constexpr double kFullWeight = 0.65;  // of the codes up to clipping: weights fall from here ...
constexpr double kNoWeight = 0.95;    // ... to here
constexpr double kSaturated = 0.98;   // clipped, in the shortest exposure
constexpr double kBelow = 3.0;        // deviations that a mean stays below clipping
constexpr double kFarBelow = 11.0;    // deviations below it: no question
constexpr double kDiffers = 4.25;     // deviations from the neighbours' mean: not noise
constexpr int kFewestAround = 3;

// Of the codes from black to where pixels clip.
double range_share(const CameraCalibration& camera, double clipping, int code) {
  return (code - camera.black_level) / (clipping - camera.black_level);
}

double weight_of(double share) {
  return std::clamp((kNoWeight - share) / (kNoWeight - kFullWeight), 0.0, 1.0);
}

}  // namespace

double noise_variance(const CameraCalibration& camera, double mean, double per_code) {
  const double read = camera.read_noise_electrons;
  return std::max(mean, 0.0) + read * read + per_code * per_code / 12.0;
}

std::vector<Electrons> electrons_by_code(const CameraCalibration& camera) {
  std::vector<Electrons> table(static_cast<std::size_t>(1) << 16);
  const int last = static_cast<int>(camera.max_code());
  for (int code = 0; code < static_cast<int>(table.size()); ++code) {
    table[static_cast<std::size_t>(code)] = electrons_from_code(camera, std::min(code, last));
  }
  return table;
}

BlackSample black_of(const ExposurePair& pair,
                     std::size_t sample,
                     std::span<const Electrons> electrons) {
  const auto of = [&](const Image<std::uint16_t>& frame) {
    return electrons[std::min<std::size_t>(frame.samples()[sample], electrons.size() - 1)];
  };
  BlackSample black{of(*pair.black), 1.0 + static_cast<double>(pair.more_black.size())};
  if (pair.told != nullptr) {
    const float told = pair.told->electrons.samples()[sample];
    if (std::isfinite(told)) return {{told, black.electrons.per_code}, 1.0 * pair.told->blacks};
  }
  for (const Image<std::uint16_t>* const more : pair.more_black)
    black.electrons.signal += of(*more).signal;
  black.electrons.signal /= black.frames;
  return black;
}

HdrMerge::HdrMerge(const CameraCalibration& camera, Image<std::uint8_t> hot)
    : camera_(camera),
      hot_(std::move(hot)),
      vignetting_(camera_vignetting(camera)),
      electrons_(electrons_by_code(camera)),
      clipping_code_(clipping_code(camera)),
      clipping_electrons_(electrons_from_code(camera, clipping_code_).signal) {
  ENSURE(hot_.width() == camera.model.width && hot_.height() == camera.model.height);
}

std::optional<double> HdrMerge::mean_around(const Image<std::uint16_t>& frame,
                                            int x,
                                            int y,
                                            int channel) const {
  double sum = 0.0;
  int count = 0;
  for (int v = std::max(0, y - 1); v <= std::min(frame.height() - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(frame.width() - 1, x + 1); ++u) {
      if ((u == x && v == y) || hot_.at(u, v) != 0) continue;
      sum += electrons_[frame.at(u, v, channel)].signal;
      ++count;
    }
  }
  return count < kFewestAround ? std::nullopt : std::optional(sum / count);
}

double HdrMerge::weight_in(const Image<std::uint16_t>& frame, int x, int y, int channel) const {
  const std::uint16_t code = frame.at(x, y, channel);
  const Electrons& own = electrons_[code];
  const double deviation = std::sqrt(noise_variance(camera_, own.signal, own.per_code));
  if (own.signal + kFarBelow * deviation < clipping_electrons_) return 1.0;
  const auto around = mean_around(frame, x, y, channel);
  if (!around || std::abs(own.signal - *around) > kDiffers * deviation)
    return weight_of(range_share(camera_, clipping_code_, code));
  const double expected = std::sqrt(noise_variance(camera_, *around, own.per_code));
  return *around + kBelow * expected < clipping_electrons_ && code < clipping_code_ ? 1.0 : 0.0;
}

double HdrMerge::variance_of(const Term& t, double rate, double leak_rate) const {
  const double scale = t.seconds / t.black_seconds;
  const double mean = (std::max(rate, 0.0) + std::max(leak_rate, 0.0)) * t.seconds;
  return noise_variance(camera_, mean, t.per_code) / t.frames +
         scale * scale * noise_variance(camera_, leak_rate * t.black_seconds, t.black_per_code) /
             t.blacks;
}

void HdrMerge::Term::add(double other_weight, double other_seconds, double other_net) {
  const double more = frames + 1.0;
  weight += (other_weight - weight) / more;
  seconds += (other_seconds - seconds) / more;
  net += (other_net - net) / more;
  frames = more;
}

HdrMerge::Sample HdrMerge::merge_sample(std::span<const ExposurePair> sorted,
                                        int x,
                                        int y,
                                        int channel) const {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): filled below
  std::array<Term, kMaxExposures> all;
  std::size_t count = 0;
  double electrons = 0.0;
  double seconds = 0.0;
  double leak = 0.0;
  double black_seconds = 0.0;
  Sample sample;
  for (const ExposurePair& pair : sorted) {
    const std::uint16_t code = pair.light->at(x, y, channel);
    const bool shortest = count == 0;
    if (shortest) sample.saturated = range_share(camera_, clipping_code_, code) >= kSaturated;
    const double weight = shortest ? 1.0 : weight_in(*pair.light, x, y, channel);
    if (weight == 0.0) continue;
    const Electrons& light = electrons_[code];
    const auto place =
        static_cast<std::size_t>(y) * pair.light->width() + static_cast<std::size_t>(x);
    const auto [black, blacks] =
        black_of(pair, 3 * place + static_cast<std::size_t>(channel), electrons_);
    const double scale = pair.light_seconds / pair.black_seconds;
    const double net = light.signal - black.signal * scale;
    if (!shortest && all[count - 1].black == pair.black) {
      all[count - 1].add(weight, pair.light_seconds, net);
      continue;
    }
    leak += blacks * black.signal;
    black_seconds += blacks * pair.black_seconds;
    all[count++] = {weight,
                    pair.light_seconds,
                    pair.black_seconds,
                    net,
                    light.per_code,
                    black.per_code,
                    1.0,
                    blacks,
                    pair.black};
  }
  const double leak_rate = leak / black_seconds;
  const auto terms = std::span(all).first(count);
  for (const Term& t : terms) {
    electrons += t.weight * t.frames * t.net;
    seconds += t.weight * t.frames * t.seconds;
  }
  const double first_estimate = electrons / seconds;
  double sum = 0.0;
  double total = 0.0;
  for (Term& t : terms) {
    t.weight *= t.seconds / variance_of(t, first_estimate, leak_rate);
    sum += t.weight * t.net;
    total += t.weight * t.seconds;
  }
  sample.rate = sum / total;
  for (const Term& t : terms)
    sample.variance += t.weight * t.weight * variance_of(t, sample.rate, leak_rate);
  sample.variance /= total * total;
  return sample;
}

HdrImage HdrMerge::merge(std::span<const ExposurePair> bracket) const {
  ENSURE(!bracket.empty() && bracket.size() <= kMaxExposures);
  std::vector<ExposurePair> sorted(bracket.begin(), bracket.end());
  std::ranges::stable_sort(sorted, {}, &ExposurePair::light_seconds);
  const int width = camera_.model.width;
  const int height = camera_.model.height;
  HdrImage hdr{Image<float>(width, height, 3),
               Image<float>(width, height, 3),
               Image<std::uint8_t>(width, height, 1),
               Image<std::uint8_t>(width, height, 1)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      bool saturated = false;
      for (int c = 0; c < 3; ++c) {
        const Sample sample = merge_sample(sorted, x, y, c);
        const double scale =
            1.0 / (camera_.sensitivity[static_cast<std::size_t>(c)] * vignetting_.at(x, y));
        hdr.radiance.at(x, y, c) = static_cast<float>(sample.rate * scale);
        hdr.variance.at(x, y, c) = static_cast<float>(sample.variance * scale * scale);
        saturated = saturated || sample.saturated;
      }
      hdr.saturated.at(x, y) = saturated ? 1 : 0;
      hdr.mask.at(x, y) = !saturated && hot_.at(x, y) == 0 ? 1 : 0;
    }
  }
  return hdr;
}

FrameLight measure_light(const CameraCalibration& camera,
                         const ExposurePair& pair,
                         const Image<std::uint8_t>& footprint,
                         double dark_quantile) {
  const double scale = pair.light_seconds / pair.black_seconds;
  const double clipping = clipping_code(camera);
  std::vector<double> snrs;
  double sum = 0.0;
  double variance = 0.0;
  std::size_t saturated = 0;
  std::size_t telling = 0;
  std::size_t clipped = 0;
  for (int y = 0; y < footprint.height(); ++y) {
    for (int x = 0; x < footprint.width(); ++x) {
      if (footprint.at(x, y) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        const int code = pair.light->at(x, y, c);
        const int black_code = pair.black->at(x, y, c);
        const bool full = range_share(camera, clipping, code) >= kNoWeight;
        if (full) ++saturated;
        const Electrons light = electrons_from_code(camera, code);
        const Electrons black = electrons_from_code(camera, black_code);
        const double net = light.signal - black.signal * scale;
        const double noise = noise_variance(camera, light.signal, light.per_code) +
                             scale * scale * noise_variance(camera, black.signal, black.per_code);
        snrs.push_back(net / std::sqrt(noise));
        if (range_share(camera, clipping, black_code) >= kNoWeight) continue;
        ++telling;
        if (full) ++clipped;
        sum += net;
        variance += noise;
      }
    }
  }
  FrameLight light;
  if (snrs.empty()) return light;
  light.statistics.saturated_share =
      static_cast<double>(saturated) / static_cast<double>(snrs.size());
  const auto place =
      static_cast<std::ptrdiff_t>(dark_quantile * static_cast<double>(snrs.size() - 1));
  std::ranges::nth_element(snrs, snrs.begin() + place);
  light.statistics.dark_snr = snrs[static_cast<std::size_t>(place)];
  if (telling == 0) return light;
  light.clipped_share = static_cast<double>(clipped) / static_cast<double>(telling);
  light.mean_electrons = sum / static_cast<double>(telling);
  light.mean_deviation = std::sqrt(variance) / static_cast<double>(telling);
  return light;
}

}  // namespace opaline::capture
