#include "reconstruct/spherical_gradient/ball_table.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

constexpr BallTable::Row kRows[]{
#include "reconstruct/spherical_gradient/ball_table.inc"
};
constexpr BallTable::Row kLowRows[]{
#include "reconstruct/spherical_gradient/ball_table_low.inc"
};
constexpr BallTable::Row kHighRows[]{
#include "reconstruct/spherical_gradient/ball_table_high.inc"
};
static_assert(std::size(kLowRows) == std::size(kRows) && std::size(kHighRows) == std::size(kRows));
constexpr double kLow = 1.3;  // indices they were traced at
constexpr double kMiddle = 1.4;
constexpr double kHigh = 1.5;
constexpr int kBendPowers = 4;      // x^1 ... x^4
constexpr double kWhite = 0.003;    // relative: better than any white target
constexpr std::size_t kPowers = 5;  // of the spread's polynomial
constexpr double kMostUneven = 100.0;
constexpr int kIterations = 40;
constexpr double kArrived = 3e-6;  // quadratic: the next step would be some 1e-11

double decay(double reduced_albedo) { return std::sqrt(3.0 * (1.0 - reduced_albedo)); }
double logit(double share) { return std::log(share / (1.0 - share)); }
double power(double base, std::size_t exponent) {
  return std::pow(base, static_cast<double>(exponent));
}
double share_of(double logit) { return 1.0 / (1.0 + std::exp(-logit)); }

/// Weighted least squares; chi^2 a degree of freedom with it.
struct Fit {
  Eigen::VectorXd coefficients;
  double misfit;
};
Result<Fit> fit(const Eigen::MatrixXd& design, const Eigen::VectorXd& right) {
  if (design.rows() <= design.cols())
    return invalid_argument(
        fmt::format("{} balls for {} coefficients", design.rows(), design.cols()));
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(design);
  if (factors.rank() < design.cols())
    return invalid_argument(
        "the balls do not determine the table's fit: more albedos or curvatures");
  Eigen::VectorXd found = factors.solve(right);
  const double chi_squared = (design * found - right).squaredNorm();
  return Fit{std::move(found), chi_squared / static_cast<double>(design.rows() - design.cols())};
}

/// Root mean square of the relative deviations of r, flat surfaces only.
double flat_deviation(std::span<const BallTable::Row> rows) {
  double sum = 0.0;
  int count = 0;
  for (const BallTable::Row& row : rows) {
    if (row.curvature > 0.0) continue;
    sum += std::pow(row.ratio_deviation / row.ratio, 2);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

/// sum c_i u^i and its derivative.
template <std::size_t N>
std::pair<double, double> polynomial(const std::array<double, N>& c, double u) {
  double value = 0.0;
  double slope = 0.0;
  for (std::size_t i = N; i-- > 0;) {
    slope = slope * u + value;
    value = value * u + c[i];
  }
  return {value, slope};
}

}  // namespace

Result<BallTable> BallTable::make(std::span<const Row> rows) {
  BallTable table;
  const auto count = static_cast<Eigen::Index>(rows.size());
  const auto bends = static_cast<Eigen::Index>(table.bend_.size());
  const auto brights = static_cast<Eigen::Index>(table.bright_.size());
  Eigen::MatrixXd bend(count, kFlat + bends * kBend);
  Eigen::MatrixXd bright(count, brights * kBright);
  Eigen::VectorXd log_ratios(count);
  Eigen::VectorXd logits(count);
  table.least_u_ = HUGE_VAL;
  table.most_u_ = -HUGE_VAL;
  for (Eigen::Index n = 0; n < count; ++n) {
    const Row& row = rows[static_cast<std::size_t>(n)];
    const double g = decay(row.reduced_albedo);
    const double u = std::log(g);
    const double ratio_weight = row.ratio / row.ratio_deviation;
    const double logit_weight = (1.0 - row.reflectance) * row.reflectance /
                                std::hypot(row.reflectance_deviation, kWhite * row.reflectance);
    log_ratios[n] = ratio_weight * std::log(row.ratio);
    logits[n] = logit_weight * logit(row.reflectance);
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < kFlat; ++i) bend(n, at++) = ratio_weight * power(g, i);
    for (std::size_t j = 1; j <= table.bend_.size(); ++j)
      for (std::size_t i = 0; i < kBend; ++i)
        bend(n, at++) = ratio_weight * power(row.curvature, j) * power(g, i + 1);
    at = 0;
    for (std::size_t j = 0; j < table.bright_.size(); ++j)
      for (std::size_t i = 0; i < kBright; ++i)
        bright(n, at++) = logit_weight * power(row.curvature, j) * power(g, i);
    table.least_u_ = std::min(table.least_u_, u);
    table.most_u_ = std::max(table.most_u_, u);
    table.most_x_ = std::max(table.most_x_, row.curvature);
  }
  const Result<Fit> ratios = fit(bend, log_ratios);
  if (!ratios) return ratios.error();
  const Result<Fit> reflectances = fit(bright, logits);
  if (!reflectances) return reflectances.error();
  Eigen::Index at = 0;
  for (double& c : table.flat_) c = ratios->coefficients[at++];
  for (auto& power : table.bend_)
    for (double& c : power) c = ratios->coefficients[at++];
  at = 0;
  for (auto& power : table.bright_)
    for (double& c : power) c = reflectances->coefficients[at++];
  table.ratio_misfit_ = ratios->misfit;
  table.ratio_deviation_ = flat_deviation(rows) *
                           std::sqrt(static_cast<double>(bend.cols()) / static_cast<double>(count));
  table.reflectance_misfit_ = reflectances->misfit;
  return table;
}

std::span<const BallTable::Row> BallTable::standard_rows() { return kRows; }

Result<BallTable> BallTable::of_index(double ior) {
  if (!(ior >= kLow && ior <= kHigh))
    return invalid_argument(
        fmt::format("refractive index {}; expected {} to {}, which were traced", ior, kLow, kHigh));
  // Lagrange's polynomials
  const std::array<double, 3> share{
      (ior - kMiddle) * (ior - kHigh) / ((kLow - kMiddle) * (kLow - kHigh)),
      (ior - kLow) * (ior - kHigh) / ((kMiddle - kLow) * (kMiddle - kHigh)),
      (ior - kLow) * (ior - kMiddle) / ((kHigh - kLow) * (kHigh - kMiddle))};
  std::vector<Row> rows;
  for (std::size_t n = 0; n < std::size(kRows); ++n) {
    const std::array<const Row*, 3> traced{&kLowRows[n], &kRows[n], &kHighRows[n]};
    double log_ratio = 0.0;
    double bright = 0.0;
    double ratio_variance = 0.0;
    double bright_variance = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Row& row = *traced[k];
      log_ratio += share[k] * std::log(row.ratio);
      bright += share[k] * logit(row.reflectance);
      ratio_variance += std::pow(share[k] * row.ratio_deviation / row.ratio, 2);
      bright_variance += std::pow(
          share[k] * row.reflectance_deviation / row.reflectance / (1.0 - row.reflectance), 2);
    }
    const double reflectance = share_of(bright);
    const double ratio = std::exp(log_ratio);
    rows.push_back({kRows[n].reduced_albedo,
                    kRows[n].curvature,
                    reflectance,
                    std::sqrt(bright_variance) * reflectance * (1.0 - reflectance),
                    ratio,
                    std::sqrt(ratio_variance) * ratio});
  }
  return make(rows);
}

const BallTable& BallTable::standard() {
  static const BallTable table = [] {
    Result<BallTable> made = make(kRows);
    ENSURE(made);
    return *std::move(made);
  }();
  return table;
}

BallTable::Value BallTable::log_ratio(double u, double x) const {
  const double g = std::exp(u);
  const auto [flat, flat_slope] = polynomial(flat_, g);
  Value bent{0.0, 0.0, 0.0};
  for (std::size_t j = bend_.size(); j-- > 0;) {
    const auto [f, slope] = polynomial(bend_[j], g);
    bent.by_x = bent.by_x * x + static_cast<double>(j + 1) * f;
    bent.value = bent.value * x + f;
    bent.by_u = bent.by_u * x + slope;
  }
  bent.value *= x;
  bent.by_u *= x;
  return {flat + g * bent.value, g * (flat_slope + bent.value + g * bent.by_u), g * bent.by_x};
}

BallTable::Value BallTable::logit_reflectance(double u, double x) const {
  const double g = std::exp(u);
  Value sum{0.0, 0.0, 0.0};
  for (std::size_t j = bright_.size(); j-- > 0;) {
    const auto [h, slope] = polynomial(bright_[j], g);
    sum.by_x = sum.by_x * x + sum.value;
    sum.value = sum.value * x + h;
    sum.by_u = sum.by_u * x + slope;
  }
  return {sum.value, g * sum.by_u, sum.by_x};
}

BallTable::Light BallTable::light(double reduced_albedo, double curvature) const {
  const double u = std::log(decay(reduced_albedo));
  return {share_of(logit_reflectance(u, curvature).value), std::exp(log_ratio(u, curvature).value)};
}

double BallTable::decay_of(double reflectance, double curvature) const {
  const double wanted = logit(reflectance);
  double low = least_u_;
  double high = most_u_;
  double u = 0.5 * (low + high);
  for (int n = 0; n < kIterations; ++n) {
    const Value at = logit_reflectance(u, curvature);
    (at.value > wanted ? low : high) = u;  // it falls with u
    const double newton = u - (at.value - wanted) / at.by_u;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (std::abs(next - u) < 1e-12) break;
    u = next;
  }
  return u;
}

double BallTable::curvature_where(const Found& found, double unevenness) const {
  if (!(unevenness > 0.0)) return found.curvature;
  const double g = decay(found.reduced_albedo);
  const double linear = polynomial(bend_[0], g).first;
  std::array<double, kPowers> spread{};  // of N(x) / x^2
  for (std::size_t j = 1; j < bend_.size(); ++j) spread[j - 1] = polynomial(bend_[j], g).first;
  const auto excess = [&](double x, double root) {
    const auto [value, slope] = polynomial(spread, root * x);
    const double z = root * x;
    return std::pair{linear * x + z * z * value, linear + root * (2.0 * z * value + z * z * slope)};
  };
  const double wanted = excess(found.curvature, 1.0).first;
  const double root = std::sqrt(1.0 + std::min(unevenness, kMostUneven));
  double x = found.curvature / root;
  for (int n = 0; n < 8; ++n) {
    const auto [value, slope] = excess(x, root);
    const double step = (wanted - value) / slope;
    x = std::clamp(x + step, 1e-3 * found.curvature, found.curvature);
    if (std::abs(step) < 1e-9) break;
  }
  return x;
}

double BallTable::flat_ratio(double reflectance) const {
  return std::exp(log_ratio(decay_of(std::clamp(reflectance, 1e-6, 1.0 - 1e-6), 0.0), 0.0).value);
}

/// Newton's iteration, kept within reach of the table; whether it arrived.
bool BallTable::search(double wanted_ratio, double wanted_logit, int steps, Place& at) const {
  for (int n = 0; n < steps; ++n) {
    at.ratio = log_ratio(at.u, at.x);
    at.logit = logit_reflectance(at.u, at.x);
    const double inverse = 1.0 / at.determinant();
    const double off_r = wanted_ratio - at.ratio.value;
    const double off_b = wanted_logit - at.logit.value;
    const double step_u =
        std::clamp((off_r * at.logit.by_x - off_b * at.ratio.by_x) * inverse, -0.5, 0.5);
    const double step_x =
        std::clamp((off_b * at.ratio.by_u - off_r * at.logit.by_u) * inverse, -0.1, 0.1);
    at.u = std::clamp(at.u + step_u, least_u_ - 0.2, most_u_ + 0.1);
    at.x = std::clamp(at.x + step_x, -0.02, 1.1 * most_x_);
    if (std::abs(step_u) + std::abs(step_x) < kArrived) return true;
  }
  return false;
}

BallTable::Found BallTable::found(double reflectance, double ratio, const Place& at) const {
  if (at.u < least_u_) return {.end = End::kTooBright};
  if (at.u > most_u_) return {.end = End::kTooDark};
  if (!(at.x > 0.0)) return {.end = End::kFlat};
  if (at.x > most_x_) return {.end = End::kTooTranslucent};
  const double det = at.determinant();
  const double by_logit = 1.0 / (reflectance * (1.0 - reflectance));
  const double g = std::exp(at.u);
  return Found{End::kFound,
               1.0 - g * g / 3.0,
               at.x,
               {-at.ratio.by_x / det * by_logit,
                at.logit.by_x / det / ratio,
                at.ratio.by_u / det / at.x * by_logit,
                -at.logit.by_u / det / at.x / ratio}};
}

BallTable::Found BallTable::find(double reflectance, double ratio) const {
  if (!(reflectance > 0.0 && reflectance < 1.0 && ratio > 0.0 && std::isfinite(ratio))) return {};
  const double wanted_ratio = std::log(ratio);
  const double wanted_logit = logit(reflectance);
  if (wanted_logit > logit_reflectance(least_u_, most_x_).value) return {.end = End::kTooBright};
  if (wanted_logit < logit_reflectance(most_u_, 0.0).value) return {.end = End::kTooDark};
  const double u = decay_of(reflectance, 0.0);
  const Value start = log_ratio(u, 0.0);
  if (wanted_ratio <= start.value) return {.end = End::kFlat};
  Place at{u, std::clamp((wanted_ratio - start.value) / start.by_x, 0.0, 0.5 * most_x_), {}, {}};
  search(wanted_ratio, wanted_logit, kIterations, at);
  return found(reflectance, ratio, at);
}

BallTable::Found BallTable::find(double reflectance, double ratio, const Found& near) const {
  constexpr int kSteps = 6;
  if (near.end == End::kFound && reflectance > 0.0 && reflectance < 1.0 && ratio > 0.0) {
    Place at{0.5 * std::log(3.0 * (1.0 - near.reduced_albedo)), near.curvature, {}, {}};
    if (search(std::log(ratio), logit(reflectance), kSteps, at)) {
      const Found answer = found(reflectance, ratio, at);
      if (answer.end == End::kFound) return answer;
    }
  }
  return find(reflectance, ratio);
}

}  // namespace opaline::reconstruct
