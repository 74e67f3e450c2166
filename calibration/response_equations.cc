#include "calibration/response_equations.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace opaline::calibration {
namespace {

constexpr double kSmoothness = 30.0;  // lambda, per pixel's worth of weight
constexpr double kBelieved = 1e-5;    // of the times, against all samples together
constexpr int kRounds = 6;

// Where a fraction lies among the knots.
struct Place {
  int knot = 0;
  double share = 0.0;  // of the next knot
};

Place place_of(double fraction) {
  const double at = std::clamp(fraction, 0.0, 1.0) * (kResponseKnots - 1);
  const int knot = std::min(static_cast<int>(at), kResponseKnots - 2);
  return {knot, at - knot};
}

// Unknowns: h at the knots, then the errors of the times.
class NormalEquations {
 public:
  explicit NormalEquations(std::span<const Exposure> stack)
      : size_(kResponseKnots + static_cast<int>(stack.size())),
        matrix_(Eigen::MatrixXd::Zero(size_, size_)),
        right_(Eigen::VectorXd::Zero(size_)) {
    for (const Exposure& exposure : stack) log_times_.push_back(std::log(exposure.seconds));
    told_.resize(log_times_.size());
  }

  // The light of the pixel is eliminated: what remains are differences from the pixel's weighted mean.
  void add(const ResponsePixel& pixel) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(size_);
    double mean_target = 0.0;
    double total = 0.0;
    for (const ResponseSample& s : pixel.samples) {
      for_each_entry(s, [&](int i, double a) { mean[i] += s.weight * a; });
      mean_target += s.weight * s.target;
      total += s.weight;
    }
    mean /= total;
    mean_target /= total;
    for (const ResponseSample& s : pixel.samples) {
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
  static void for_each_entry(const ResponseSample& s, Use use) {
    const Place p = place_of(s.fraction);
    use(p.knot, 1.0 - p.share);
    use(p.knot + 1, p.share);
    use(kResponseKnots + static_cast<int>(s.exposure), -1.0);
  }

  void subtract_mean(const ResponsePixel& pixel, const Eigen::VectorXd& mean, double weight) {
    std::vector<int> touched;
    for (const ResponseSample& s : pixel.samples) {
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
    for (int k = 1; k + 1 < kResponseKnots; ++k) {
      const double f = static_cast<double>(k) / (kResponseKnots - 1);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(size_);
      row[k - 1] = 1.0 - 0.5 / k;
      row[k + 1] = 1.0 + 0.5 / k;
      row[k] = -2.0;
      add_row(row, kSmoothness * weight_ / kResponseKnots * f * std::max(f * (1.0 - f), 0.02));
    }
  }

  // The scale of the light, and a constant and a power that times share with it.
  void add_gauge() {
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(size_);
    scale[kResponseKnots / 2] = 1.0;
    add_row(scale, weight_);
    Eigen::VectorXd constant = Eigen::VectorXd::Zero(size_);
    Eigen::VectorXd power = Eigen::VectorXd::Zero(size_);
    double mean = 0.0;
    for (std::size_t j = 0; j < log_times_.size(); ++j) mean += log_times_[j] * told_[j] / weight_;
    for (std::size_t j = 0; j < log_times_.size(); ++j) {
      const int d = kResponseKnots + static_cast<int>(j);
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

void measure_residual(ResponsePixel& pixel, const Eigen::VectorXd& unknowns) {
  double sum = 0.0;
  double squares = 0.0;
  double total = 0.0;
  for (const ResponseSample& s : pixel.samples) {
    const double r = response_between(unknowns, s.fraction) -
                     unknowns[kResponseKnots + static_cast<int>(s.exposure)] - s.target;
    sum += s.weight * r;
    squares += s.weight * r * r;
    total += s.weight;
  }
  pixel.residual = std::sqrt(std::max(0.0, squares / total - sum * sum / (total * total)));
}

double median_residual(const std::vector<ResponsePixel>& pixels) {
  std::vector<double> residuals;
  residuals.reserve(pixels.size());
  for (const ResponsePixel& pixel : pixels) residuals.push_back(pixel.residual);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::ranges::nth_element(residuals, middle);
  return *middle;
}

}  // namespace

double response_between(const Eigen::VectorXd& unknowns, double fraction) {
  const Place p = place_of(fraction);
  return (1.0 - p.share) * unknowns[p.knot] + p.share * unknowns[p.knot + 1];
}

Eigen::VectorXd solve_response(std::vector<ResponsePixel>& pixels,
                               std::span<const Exposure> stack) {
  Eigen::VectorXd unknowns;
  for (int round = 0; round < kRounds; ++round) {
    NormalEquations equations(stack);
    for (const ResponsePixel& pixel : pixels) equations.add(pixel);
    unknowns = equations.solve();
    for (ResponsePixel& pixel : pixels) measure_residual(pixel, unknowns);
    const double scale = std::max(3.0 * median_residual(pixels), 1e-4);
    for (ResponsePixel& pixel : pixels) {
      const double ratio = pixel.residual / scale;
      pixel.trust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
    }
  }
  return unknowns;
}

}  // namespace opaline::calibration
