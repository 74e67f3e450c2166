#include "capture/told_black.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "capture/cholesky.h"

namespace opaline::capture {
namespace {

constexpr std::size_t kShares = 6;
constexpr std::size_t kNumbers = kShares + 1;
using Terms = std::array<double, kNumbers>;

constexpr double kRidge =
    1e-9;  // of the normal matrix: even white light and what is constant are alike

constexpr double kNearFull = 0.9;  // of the codes up to clipping
constexpr double kMostFull = 0.02;
constexpr double kPixelsOff = 1.25;
constexpr double kBlocksOff = 1.5;
constexpr int kBlock = 8;
constexpr int kFewestInBlock = 32;
constexpr double kFewestBlocks = 4.0;
constexpr double kCellPixels = 16.0;
constexpr double kMostBlacks = 1000.0;

/// The white picture's light, electrons a second, and its variance; NaN where it clips.
struct White {
  Image<float> rate;
  Image<float> variance;
};

White white_of(const CameraCalibration& camera, std::span<const ExposurePair> pairs) {
  const double full = camera.black_level + kNearFull * (clipping_code(camera) - camera.black_level);
  const Image<std::uint16_t>& first = *pairs.front().light;
  White white{Image<float>(first.width(), first.height(), 3),
              Image<float>(first.width(), first.height(), 3)};
  for (std::size_t i = 0; i < white.rate.samples().size(); ++i) {
    double net = 0.0;
    double variance = 0.0;
    double seconds = 0.0;
    bool clips = false;
    for (const ExposurePair& pair : pairs) {
      const std::uint16_t code = pair.light->samples()[i];
      clips = clips || code > full;
      const Electrons light = electrons_from_code(camera, code);
      const Electrons black = electrons_from_code(camera, pair.black->samples()[i]);
      const double scale = pair.light_seconds / pair.black_seconds;
      net += light.signal - scale * black.signal;
      // The black frame is the same of all pairs: its noise adds up, not its variance.
      variance += noise_variance(camera, light.signal, light.per_code) +
                  static_cast<double>(pairs.size()) * scale * scale *
                      noise_variance(camera, black.signal, black.per_code);
      seconds += pair.light_seconds;
    }
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    white.rate.samples()[i] = clips ? kUnknown : static_cast<float>(net / seconds);
    white.variance.samples()[i] = static_cast<float>(variance / (seconds * seconds));
  }
  return white;
}

/// One channel of the black frames, and the white light that is to tell it.
class Channel {
 public:
  Channel(const CameraCalibration& camera,
          std::span<const Image<std::uint16_t>* const> blacks,
          double seconds,
          const White& white,
          const Image<std::uint8_t>& seen,
          int channel)
      : camera_(camera),
        blacks_(blacks),
        seconds_(seconds),
        white_(white),
        seen_(seen),
        channel_(channel) {}

  /// Whether white tells it.
  bool fit() {
    std::vector<double> normal(kNumbers * kNumbers);
    std::vector<double> right(kNumbers);
    int full = 0;
    for_each([&](int x, int y) {
      if (!std::isfinite(white_.rate.at(x, y, channel_))) {
        ++full;
        return;
      }
      const Terms terms = terms_at(x, y);
      const double mean = mean_at(x, y);
      for (std::size_t i = 0; i < kNumbers; ++i) {
        right[i] += terms[i] * mean;
        for (std::size_t j = 0; j < kNumbers; ++j) normal[i * kNumbers + j] += terms[i] * terms[j];
      }
      ++pixels_;
    });
    if (pixels_ < kBlock * kBlock * kFewestBlocks || full > kMostFull * pixels_) return false;
    return solve(normal, right) && agrees();
  }

  double electrons_at(int x, int y) const { return dot(terms_at(x, y)); }

  /// The variance of one black frame over that of what is told, the middle of all pixels.
  double worth() const {
    std::vector<double> shares;
    for_each([&](int x, int y) {
      if (!std::isfinite(white_.rate.at(x, y, channel_))) return;
      Terms terms = terms_at(x, y);
      terms[kShares] = 0.0;
      const double slope = dot(terms) / white_.rate.at(x, y, channel_);
      shares.push_back(slope * slope * white_.variance.at(x, y, channel_) / noise_at(x, y));
    });
    const auto middle = shares.begin() + std::ssize(shares) / 2;
    std::ranges::nth_element(shares, middle);
    const double numbers =
        kCellPixels * kNumbers / (static_cast<double>(pixels_) * static_cast<double>(count()));
    return 1.0 / (*middle + numbers);
  }

 private:
  // Columns to one length first: white runs to 1e5 electrons a second, the last term is 1.
  bool solve(std::vector<double>& normal, std::vector<double>& right) {
    Terms scale{};
    for (std::size_t i = 0; i < kNumbers; ++i) {
      const double squares = normal[i * kNumbers + i];
      if (!(squares > 0.0)) return false;
      scale[i] = 1.0 / std::sqrt(squares);
    }
    for (std::size_t i = 0; i < kNumbers; ++i) {
      right[i] *= scale[i];
      for (std::size_t j = 0; j < kNumbers; ++j) normal[i * kNumbers + j] *= scale[i] * scale[j];
      normal[i * kNumbers + i] += kRidge;
    }
    const std::vector<double> scaled = solve_cholesky(normal, std::move(right));
    for (std::size_t i = 0; i < kNumbers; ++i) numbers_[i] = scale[i] * scaled[i];
    return true;
  }

  double dot(const Terms& terms) const {
    return std::inner_product(terms.begin(), terms.end(), numbers_.begin(), 0.0);
  }

  std::size_t count() const { return blacks_.size(); }

  template <class Visit>
  void for_each(Visit visit) const {
    for (int y = 0; y < seen_.height(); ++y) {
      for (int x = 0; x < seen_.width(); ++x) {
        if (seen_.at(x, y) != 0) visit(x, y);
      }
    }
  }

  Terms terms_at(int x, int y) const {
    const double u = 2.0 * (x + 0.5) / seen_.width() - 1.0;
    const double v = 2.0 * (y + 0.5) / seen_.height() - 1.0;
    const double light = seconds_ * white_.rate.at(x, y, channel_);
    return {light, light * u, light * v, light * u * u, light * u * v, light * v * v, 1.0};
  }

  double mean_at(int x, int y) const {
    double sum = 0.0;
    for (const auto* const black : blacks_)
      sum += electrons_from_code(camera_, black->at(x, y, channel_)).signal;
    return sum / static_cast<double>(count());
  }

  double noise_at(int x, int y) const {  // of one frame
    const Electrons own = electrons_from_code(camera_, blacks_.front()->at(x, y, channel_));
    return noise_variance(camera_, electrons_at(x, y), own.per_code);
  }

  // What is left is noise, of single pixels and of their means over blocks.
  bool agrees() const {
    double squares = 0.0;
    double pixels = 0.0;
    double block_squares = 0.0;
    double blocks = 0.0;
    for (int top = 0; top < seen_.height(); top += kBlock) {
      for (int left = 0; left < seen_.width(); left += kBlock) {
        double sum = 0.0;
        double variance = 0.0;
        int used = 0;
        for (int y = top; y < std::min(top + kBlock, seen_.height()); ++y) {
          for (int x = left; x < std::min(left + kBlock, seen_.width()); ++x) {
            if (seen_.at(x, y) == 0 || !std::isfinite(white_.rate.at(x, y, channel_))) continue;
            const double off = mean_at(x, y) - electrons_at(x, y);
            const double noise = noise_at(x, y) / static_cast<double>(count());
            squares += off * off / noise;
            sum += off;
            variance += noise;
            ++used;
          }
        }
        pixels += used;
        if (used < kFewestInBlock) continue;
        block_squares += sum * sum / variance;
        blocks += 1.0;
      }
    }
    return blocks >= kFewestBlocks && squares <= kPixelsOff * pixels &&
           block_squares <= kBlocksOff * blocks;
  }

  const CameraCalibration& camera_;
  std::span<const Image<std::uint16_t>* const> blacks_;
  double seconds_;
  const White& white_;
  const Image<std::uint8_t>& seen_;
  int channel_;
  Terms numbers_{};
  int pixels_ = 0;
};

}  // namespace

std::optional<ToldBlack> tell_black(const CameraCalibration& camera,
                                    std::span<const Image<std::uint16_t>* const> blacks,
                                    double black_seconds,
                                    std::span<const ExposurePair> pairs,
                                    const Image<std::uint8_t>& seen) {
  if (blacks.empty() || pairs.empty()) return std::nullopt;
  const White white = white_of(camera, pairs);
  ToldBlack told{
      Image<float>(seen.width(), seen.height(), 3, std::numeric_limits<float>::quiet_NaN())};
  double worth = kMostBlacks;
  for (int c = 0; c < 3; ++c) {
    Channel channel(camera, blacks, black_seconds, white, seen, c);
    if (!channel.fit()) return std::nullopt;
    worth = std::min(worth, channel.worth());
    for (int y = 0; y < seen.height(); ++y) {
      for (int x = 0; x < seen.width(); ++x) {
        if (seen.at(x, y) != 0)  // NaN where white clips
          told.electrons.at(x, y, c) = static_cast<float>(channel.electrons_at(x, y));
      }
    }
  }
  if (worth < static_cast<double>(blacks.size()))
    return std::nullopt;  // by themselves they tell more
  told.blacks = static_cast<int>(worth);
  return told;
}

}  // namespace opaline::capture
