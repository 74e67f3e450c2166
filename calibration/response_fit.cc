#include "calibration/response_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace opaline::calibration {
namespace {

constexpr int kKnots = 65;
constexpr int kTable = 257;
constexpr std::size_t kMostPixels = 6000;
constexpr int kFewestPixels = 50;
constexpr double kLowest = 0.01;
constexpr double kHighest = 0.98;
constexpr double kToe = 1.5;          // times the lowest code that tells
constexpr double kTelling = 1.9;      // times as long: a growth that noise does not hide
constexpr double kGrowth = 1.05;      // of the code, at least, where the time doubles
constexpr double kSmoothness = 30.0;  // lambda, per pixel's worth of weight
constexpr double kBelieved = 1e-5;    // of the times, against all samples together
constexpr int kRounds = 6;

struct Sample {
  std::size_t exposure = 0;
  double fraction = 0.0;
  double weight = 0.0;
  double target = 0.0;  // ln t - ln f
};

struct Pixel {
  std::vector<Sample> samples;
  double trust = 1.0;
  double residual = 0.0;
};

// Where a fraction lies among the knots.
struct Place {
  int knot = 0;
  double share = 0.0;  // of the next knot
};

Place place_of(double fraction) {
  const double at = std::clamp(fraction, 0.0, 1.0) * (kKnots - 1);
  const int knot = std::min(static_cast<int>(at), kKnots - 2);
  return {knot, at - knot};
}

double between(const Eigen::VectorXd& unknowns, double fraction) {
  const Place p = place_of(fraction);
  return (1.0 - p.share) * unknowns[p.knot] + p.share * unknowns[p.knot + 1];
}

double lowest_of(CodeRange range) {
  return std::max(kLowest, range.floor / (range.clipping - range.black));
}

// From the first sample to the first one at least twice as long: closer ones differ by less than noise and rounding may take away.
bool stuck(const std::vector<Sample>& samples, std::span<const Exposure> stack) {
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

std::vector<Sample> samples_of(std::span<const Exposure> stack,
                               CodeRange range,
                               int channel,
                               std::size_t pixel) {
  std::vector<Sample> samples;
  const double lowest = lowest_of(range);
  for (std::size_t j = 0; j < stack.size(); ++j) {
    const Image<std::uint16_t>& frame = *stack[j].frame;
    const double code = frame.samples()[pixel * frame.channels() + channel];
    const double f = (code - range.black) / (range.clipping - range.black);
    if (f <= lowest || f >= kHighest) continue;
    samples.push_back({j, f, f * (1.0 - f), std::log(stack[j].seconds) - std::log(f)});
  }
  return samples;
}

struct Pixels {
  std::vector<Pixel> telling;
  int refused = 0;
};

Pixels collect(std::span<const Exposure> stack, CodeRange range, int channel) {
  Pixels pixels;
  const std::size_t count = stack.front().frame->pixel_count();
  const std::size_t stride = std::max<std::size_t>(1, count / kMostPixels);
  for (std::size_t i = 0; i < count; i += stride) {
    Pixel pixel;
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

// Unknowns: h at the knots, then the errors of the times.
class NormalEquations {
 public:
  explicit NormalEquations(std::span<const Exposure> stack)
      : size_(kKnots + static_cast<int>(stack.size())),
        matrix_(Eigen::MatrixXd::Zero(size_, size_)),
        right_(Eigen::VectorXd::Zero(size_)) {
    for (const Exposure& exposure : stack) log_times_.push_back(std::log(exposure.seconds));
    told_.resize(log_times_.size());
  }

  // The light of the pixel is eliminated: what remains are differences from the pixel's weighted mean.
  void add(const Pixel& pixel) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(size_);
    double mean_target = 0.0;
    double total = 0.0;
    for (const Sample& s : pixel.samples) {
      for_each_entry(s, [&](int i, double a) { mean[i] += s.weight * a; });
      mean_target += s.weight * s.target;
      total += s.weight;
    }
    mean /= total;
    mean_target /= total;
    for (const Sample& s : pixel.samples) {
      const double weight = pixel.trust * s.weight;
      weight_ += weight;
      told_[s.exposure] += weight;
      for_each_entry(s, [&](int i, double a) {
        for_each_entry(s, [&](int j, double b) { matrix_(i, j) += weight * a * b; });
        right_[i] += weight * a * (s.target - mean_target);
      });
    }
    subtract_mean(pixel, mean, pixel.trust * total);
  }

  Eigen::VectorXd solve() {
    add_smoothness();
    add_gauge();
    return matrix_.ldlt().solve(right_);
  }

 private:
  template <class Use>
  static void for_each_entry(const Sample& s, Use use) {
    const Place p = place_of(s.fraction);
    use(p.knot, 1.0 - p.share);
    use(p.knot + 1, p.share);
    use(kKnots + static_cast<int>(s.exposure), -1.0);
  }

  void subtract_mean(const Pixel& pixel, const Eigen::VectorXd& mean, double weight) {
    std::vector<int> touched;
    for (const Sample& s : pixel.samples) {
      for_each_entry(s, [&](int i, double) { touched.push_back(i); });
    }
    std::ranges::sort(touched);
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const int i : touched) {
      for (const int j : touched) matrix_(i, j) -= weight * mean[i] * mean[j];
    }
  }

  void add_row(const Eigen::VectorXd& row, double weight) {
    matrix_ += weight * row * row.transpose();
  }

  void add_smoothness() {
    for (int k = 1; k + 1 < kKnots; ++k) {
      const double f = static_cast<double>(k) / (kKnots - 1);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(size_);
      row[k - 1] = 1.0 - 0.5 / k;
      row[k + 1] = 1.0 + 0.5 / k;
      row[k] = -2.0;
      add_row(row, kSmoothness * weight_ / kKnots * f * std::max(f * (1.0 - f), 0.02));
    }
  }

  // The scale of the light, and a constant and a power that times share with it.
  void add_gauge() {
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(size_);
    scale[kKnots / 2] = 1.0;
    add_row(scale, weight_);
    Eigen::VectorXd constant = Eigen::VectorXd::Zero(size_);
    Eigen::VectorXd power = Eigen::VectorXd::Zero(size_);
    double mean = 0.0;
    for (std::size_t j = 0; j < log_times_.size(); ++j) mean += log_times_[j] * told_[j] / weight_;
    for (std::size_t j = 0; j < log_times_.size(); ++j) {
      const int d = kKnots + static_cast<int>(j);
      const double share =
          told_[j] /
          weight_;  // one that few samples tell of could have any error that suits the others
      constant[d] = share;
      power[d] = share * (log_times_[j] - mean);
      matrix_(d, d) += kBelieved * weight_;
    }
    add_row(constant, weight_);
    add_row(power, weight_);
    matrix_.diagonal().array() += 1e-9 * weight_;
  }

  int size_;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
  std::vector<double> log_times_;
  std::vector<double> told_;  // the samples' weight, by exposure
  double weight_ = 0.0;
};

void measure_residual(Pixel& pixel, const Eigen::VectorXd& unknowns) {
  double sum = 0.0;
  double squares = 0.0;
  double total = 0.0;
  for (const Sample& s : pixel.samples) {
    const double r =
        between(unknowns, s.fraction) - unknowns[kKnots + static_cast<int>(s.exposure)] - s.target;
    sum += s.weight * r;
    squares += s.weight * r * r;
    total += s.weight;
  }
  pixel.residual = std::sqrt(std::max(0.0, squares / total - sum * sum / (total * total)));
}

double median_residual(const std::vector<Pixel>& pixels) {
  std::vector<double> residuals;
  residuals.reserve(pixels.size());
  for (const Pixel& pixel : pixels) residuals.push_back(pixel.residual);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::ranges::nth_element(residuals, middle);
  return *middle;
}

Eigen::VectorXd fit(std::vector<Pixel>& pixels, std::span<const Exposure> stack) {
  Eigen::VectorXd unknowns;
  for (int round = 0; round < kRounds; ++round) {
    NormalEquations equations(stack);
    for (const Pixel& pixel : pixels) equations.add(pixel);
    unknowns = equations.solve();
    for (Pixel& pixel : pixels) measure_residual(pixel, unknowns);
    const double scale = std::max(3.0 * median_residual(pixels), 1e-4);
    for (Pixel& pixel : pixels) {
      const double ratio = pixel.residual / scale;
      pixel.trust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
    }
  }
  return unknowns;
}

// Isotonic regression by pooling neighbours that fall (Ayer et al. 1955).
void pool_falling(std::vector<double>& values) {
  struct Block {
    double sum;
    std::size_t count;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<Block> blocks;
  for (const double value : values) {
    blocks.push_back({value, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean() > blocks.back().mean()) {
      const Block last = blocks.back();
      blocks.pop_back();
      blocks.back().sum += last.sum;
      blocks.back().count += last.count;
    }
  }
  std::size_t i = 0;
  for (const Block& block : blocks) {
    for (std::size_t k = 0; k < block.count; ++k) values[i++] = block.mean();
  }
}

// Where no sample tells: the power of f that the curve goes with just above.
double toe(const Eigen::VectorXd& unknowns, double from, double f) {
  const double at = between(unknowns, from);
  const double power = (between(unknowns, kToe * from) - at) / std::log(kToe);
  return f * std::exp(at + power * std::log(f / from));
}

capture::ResponseCurve curve_of(const Eigen::VectorXd& unknowns, double lowest) {
  std::vector<double> table{0.0};
  for (int i = 1; i < kTable; ++i) {
    const double f = static_cast<double>(i) / (kTable - 1);
    table.push_back(f < lowest ? toe(unknowns, lowest, f) : f * std::exp(between(unknowns, f)));
  }
  pool_falling(table);
  const double full = table.back();
  for (int i = 0; i < kTable; ++i) {
    const double ramp = 1e-9 * i;  // strictly increasing where values were pooled
    table[static_cast<std::size_t>(i)] =
        (table[static_cast<std::size_t>(i)] / full + ramp) / (1.0 + 1e-9 * (kTable - 1));
  }
  table.front() = 0.0;
  table.back() = 1.0;
  return {capture::ResponseCurve::Kind::kTable, 1.0, std::move(table)};
}

Result<void> check(std::span<const Exposure> stack, CodeRange range, int channel) {
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

Result<void> check_told(const Pixels& pixels, CodeRange range) {
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
  for (const Pixel& pixel : pixels.telling) {
    for (const Sample& s : pixel.samples) {
      lowest = std::min(lowest, s.fraction);
      highest = std::max(highest, s.fraction);
    }
  }
  if (lowest > std::max(0.05, 1.25 * lowest_of(range)) || highest < 0.95)
    return invalid_argument(
        fmt::format("the stack tells of {:.0f} to {:.0f} % of the code range; 5 to 95 % are "
                    "needed: add longer and shorter exposures",
                    100.0 * lowest,
                    100.0 * highest));
  return ok();
}

}  // namespace

Result<ResponseFit> fit_response(std::span<const Exposure> stack, CodeRange range, int channel) {
  if (auto checked = check(stack, range, channel); !checked) return checked.error();
  Pixels pixels = collect(stack, range, channel);
  if (auto told = check_told(pixels, range); !told) return told.error();
  const Eigen::VectorXd unknowns = fit(pixels.telling, stack);
  ResponseFit result{curve_of(unknowns, lowest_of(range)), {}, 0.0, 0, pixels.refused};
  for (std::size_t j = 0; j < stack.size(); ++j) {
    result.seconds.push_back(stack[j].seconds * std::exp(unknowns[kKnots + static_cast<int>(j)]));
  }
  double squares = 0.0;
  for (const Pixel& pixel : pixels.telling) {
    if (pixel.trust < 0.05) {
      ++result.pixels_refused;
      continue;
    }
    ++result.pixels_used;
    squares += pixel.residual * pixel.residual;
  }
  result.residual = std::sqrt(squares / std::max(1, result.pixels_used));
  return result;
}

double signal_at(const capture::ResponseCurve& curve, double fraction) {
  const double f = std::clamp(fraction, 0.0, 1.0);
  if (curve.kind == capture::ResponseCurve::Kind::kLinear) return f;
  if (curve.kind == capture::ResponseCurve::Kind::kGamma) return std::pow(f, curve.gamma);
  const double at = f * static_cast<double>(curve.table.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), curve.table.size() - 2);
  const double share = at - static_cast<double>(i);
  return (1.0 - share) * curve.table[i] + share * curve.table[i + 1];
}

double departure_from_line(const capture::ResponseCurve& curve) {
  double products = 0.0;
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double f = 0.01 * i;
    products += f * signal_at(curve, f);
    squares += f * f;
  }
  double most = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double f = 0.01 * i;
    most = std::max(most, std::abs(signal_at(curve, f) - products / squares * f));
  }
  return most;
}

}  // namespace opaline::calibration
