#include "capture/exposure_planning.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace opaline::capture {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kGoodEnough =
    0.99;  // of the best found: what is bounded above it is not looked at
constexpr int kMostBranches = 1000;
constexpr int kMostAlike = 16;
constexpr double kBelowClipping = 3.0;  // standard deviations

int blacks_of(const ExposureProblem& problem, std::size_t k) {
  return k < problem.blacks.size() ? problem.blacks[k] : 1;
}

double information(const ExposureProblem& problem,
                   const CellLight& cell,
                   std::size_t k,
                   int frames) {
  if (frames == 0) return 0.0;
  const double t = problem.seconds[k];
  const double full = cell.brightest * t;
  const double deviation = std::sqrt(std::max(full, 0.0) + problem.read_variance);
  if (full + kBelowClipping * deviation > problem.clipping_electrons) return 0.0;
  const double leak = cell.leak * t + problem.read_variance;
  const double light = cell.rate * t;
  return cell.pixels * light * light / ((light + leak) / frames + leak / blacks_of(problem, k));
}

int taken_of(const ExposureProblem& problem, std::size_t k) {
  return k < problem.taken.size() ? problem.taken[k] : 0;
}

// Of the cells' seconds, what `share` of them need.
double share_quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto n = static_cast<double>(values.size());
  const auto place = static_cast<std::ptrdiff_t>(std::ceil(share * n - 1e-9)) - 1;
  const auto nth = values.begin() + std::clamp<std::ptrdiff_t>(place, 0, std::ssize(values) - 1);
  std::ranges::nth_element(values, nth);
  return *nth;
}

std::vector<double> missing_information(const ExposureProblem& problem) {
  std::vector<double> missing;
  for (const auto& cell : problem.cells) {
    for (const CellLight& light : cell) {
      double have = 0.0;
      for (std::size_t k = 0; k < problem.seconds.size(); ++k)
        have += information(problem, light, k, taken_of(problem, k));
      missing.push_back(light.wanted_snr * light.wanted_snr - have);
    }
  }
  return missing;
}

/// The search. Cells times channels are counted through: 3 cell + channel.
class Branches {
 public:
  explicit Branches(const ExposureProblem& problem)
      : problem_(problem), chosen_(problem.seconds.size(), 0), best_seconds_(problem.most_seconds) {
    std::vector<double> fastest(3 * problem.cells.size(), 0.0);
    for (std::size_t k = 0; k < problem.seconds.size(); ++k) {
      const double t = problem.seconds[k];
      for (std::size_t i = 0; i < fastest.size(); ++i)
        fastest[i] = std::max(fastest[i], gain(k, i, 1) / t);
      fastest_.push_back(fastest);
    }
  }

  ExposureAnswer run() {
    const std::vector<double> missing = missing_information(problem_);
    answer_.bound = bound(missing, problem_.seconds.size());
    if (answer_.bound <= 0.0) return {std::move(chosen_), 0.0, 0.0, true};
    branch(problem_.seconds.size(), missing, 0.0);
    return std::move(answer_);
  }

 private:
  // What `frames` more of an exposure add.
  double gain(std::size_t k, std::size_t i, int frames) const {
    const CellLight& cell = problem_.cells[i / 3][i % 3];
    const int taken = taken_of(problem_, k);
    return information(problem_, cell, k, taken + frames) - information(problem_, cell, k, taken);
  }

  // Seconds that are needed at least where only the `exposures` shortest are left.
  double bound(const std::vector<double>& missing, std::size_t exposures) {
    needs_.resize(problem_.cells.size());
    for (std::size_t cell = 0; cell < needs_.size(); ++cell) {
      double seconds = 0.0;
      for (std::size_t i = 3 * cell; i < 3 * cell + 3; ++i) {
        if (missing[i] <= 0.0) continue;
        const double speed = exposures == 0 ? 0.0 : fastest_[exposures - 1][i];
        const double needed = speed > 0.0 ? missing[i] / speed : kNever;
        seconds = std::max(seconds, needed);
      }
      needs_[cell] = seconds;
    }
    return share_quantile(needs_, problem_.share);
  }

  void branch(std::size_t exposures, const std::vector<double>& missing, double seconds) {
    const double least = bound(missing, exposures);
    if (least <= 0.0) return keep(seconds);
    if (seconds + least >= best_limit() || ++branches_ > kMostBranches) return;
    const std::size_t k = exposures - 1;
    const double left_seconds = best_limit() - seconds;
    const int most =
        static_cast<int>(std::min(left_seconds / problem_.seconds[k], 1.0 * kMostAlike));
    const int likely = static_cast<int>(std::min(least / problem_.seconds[k], 1.0 * most));
    for (const int frames : order(likely, most)) {
      const double total = seconds + frames * problem_.seconds[k];
      if (total > best_limit()) continue;
      chosen_[k] = frames;
      std::vector<double> left = missing;
      if (frames > 0) {
        for (std::size_t i = 0; i < left.size(); ++i) left[i] -= gain(k, i, frames);
      }
      branch(k, left, total);
    }
    chosen_[k] = 0;
  }

  // The likely number first, then one more, fewer, and more.
  static std::vector<int> order(int likely, int most) {
    std::vector<int> numbers{likely};
    if (likely < most) numbers.push_back(likely + 1);
    for (int n = likely - 1; n >= 0; --n) numbers.push_back(n);
    for (int n = likely + 2; n <= most; ++n) numbers.push_back(n);
    return numbers;
  }

  double best_limit() const {
    return answer_.reaches ? kGoodEnough * best_seconds_ : best_seconds_ * (1.0 + 1e-9);
  }

  void keep(double seconds) {
    if (answer_.reaches && seconds >= best_seconds_) return;
    if (seconds > problem_.most_seconds * (1.0 + 1e-9)) return;
    answer_.reaches = true;
    answer_.frames = chosen_;
    answer_.seconds = best_seconds_ = seconds;
  }

  const ExposureProblem& problem_;
  std::vector<int> chosen_;
  double best_seconds_;
  std::vector<std::vector<double>> fastest_;  // by exposure, of it and all shorter: SNR^2 a second
  std::vector<double> needs_;
  ExposureAnswer answer_;
  int branches_ = 0;
};

}  // namespace

ExposureAnswer plan_exposures(const ExposureProblem& problem) { return Branches(problem).run(); }

double share_reached(const ExposureProblem& problem) {
  const std::vector<double> missing = missing_information(problem);
  std::size_t reached = 0;
  for (std::size_t cell = 0; cell < problem.cells.size(); ++cell) {
    if (std::ranges::all_of(std::span(missing).subspan(3 * cell, 3),
                            [](double m) { return m <= 0.0; }))
      ++reached;
  }
  return problem.cells.empty()
             ? 1.0
             : static_cast<double>(reached) / static_cast<double>(problem.cells.size());
}

double photon_limit(const ExposureProblem& problem) {
  std::vector<double> seconds;
  for (const auto& cell : problem.cells) {
    double most = 0.0;
    for (const CellLight& c : cell)
      most = std::max(
          most, c.wanted_snr * c.wanted_snr * (c.rate + c.leak) / (c.pixels * c.rate * c.rate));
    seconds.push_back(most);
  }
  return share_quantile(seconds, problem.share);
}

}  // namespace opaline::capture
