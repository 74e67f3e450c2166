#include "calibration/color_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace opaline::calibration {
namespace {

constexpr int kLabSteps = 8;
constexpr double kSlopeStep = 1e-6;

int term_count(ColorModel model) { return model == ColorModel::kMatrix ? 3 : 6; }

Eigen::VectorXd terms_of(ColorModel model, const CameraRgb& balance, const CameraRgb& rgb) {
  const std::vector<double> terms = color_terms(model, balance, rgb);
  return Eigen::Map<const Eigen::VectorXd>(terms.data(), static_cast<Eigen::Index>(terms.size()));
}

Xyz xyz_of(const Eigen::MatrixXd& m, const Eigen::VectorXd& terms) {
  const Eigen::Vector3d v = m * terms;
  return {v[0], v[1], v[2]};
}

// d Lab / d XYZ.
Eigen::Matrix3d lab_slopes(const Xyz& xyz) {
  Eigen::Matrix3d slopes;
  for (std::size_t j = 0; j < 3; ++j) {
    Xyz more = xyz;
    Xyz less = xyz;
    more[j] += kSlopeStep;
    less[j] -= kSlopeStep;
    const Lab high = lab_from_xyz(more);
    const Lab low = lab_from_xyz(less);
    for (std::size_t i = 0; i < 3; ++i)
      slopes(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          (high[i] - low[i]) / (2.0 * kSlopeStep);
  }
  return slopes;
}

// One step of Gauss and Newton towards the references in CIELAB.
bool step_in_lab(Eigen::MatrixXd& m,
                 const std::vector<Eigen::VectorXd>& terms,
                 std::span<const Lab> references) {
  const Eigen::Index n = m.cols();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(3 * n);
  for (std::size_t p = 0; p < terms.size(); ++p) {
    const Xyz xyz = xyz_of(m, terms[p]);
    const Lab lab = lab_from_xyz(xyz);
    Eigen::MatrixXd jacobian(3, 3 * n);
    const Eigen::Matrix3d slopes = lab_slopes(xyz);
    for (Eigen::Index row = 0; row < 3; ++row)
      jacobian.middleCols(row * n, n) = slopes.col(row) * terms[p].transpose();
    const Eigen::Vector3d off(
        references[p][0] - lab[0], references[p][1] - lab[1], references[p][2] - lab[2]);
    normal += jacobian.transpose() * jacobian;
    right += jacobian.transpose() * off;
  }
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  const Eigen::VectorXd change = solver.solve(right);
  if (!change.allFinite()) return false;
  for (Eigen::Index row = 0; row < 3; ++row) m.row(row) += change.segment(row * n, n).transpose();
  return true;
}

double lab_error(const Eigen::MatrixXd& m,
                 const std::vector<Eigen::VectorXd>& terms,
                 std::span<const Lab> references) {
  double sum = 0.0;
  for (std::size_t p = 0; p < terms.size(); ++p) {
    const Lab lab = lab_from_xyz(xyz_of(m, terms[p]));
    for (std::size_t i = 0; i < 3; ++i) sum += std::pow(lab[i] - references[p][i], 2.0);
  }
  return sum;
}

double correlation(std::span<const double> a, std::span<const double> b) {
  const auto n = static_cast<Eigen::Index>(a.size());
  const Eigen::Map<const Eigen::VectorXd> x(a.data(), n);
  const Eigen::Map<const Eigen::VectorXd> y(b.data(), n);
  const Eigen::VectorXd dx = x.array() - x.mean();
  const Eigen::VectorXd dy = y.array() - y.mean();
  return dx.dot(dy) / std::sqrt(dx.squaredNorm() * dy.squaredNorm());
}

// The shares of a colour's three values: what is left without its brightness.
std::array<double, 3> shares(const std::array<double, 3>& v) {
  const double sum = v[0] + v[1] + v[2];
  return sum > 0.0 ? std::array<double, 3>{v[0] / sum, v[1] / sum, v[2] / sum}
                   : std::array<double, 3>{};
}

std::array<double, 3> rgb_of(const Lab& lab) {
  std::array<double, 3> rgb = linear_srgb(xyz_from_lab(lab));
  for (double& v : rgb) v = std::max(0.0, v);
  return rgb;
}

double quantile_of_sorted(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

template <class T>
std::vector<T> without(std::span<const T> all, std::size_t left_out) {
  std::vector<T> rest(all.begin(), all.end());
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(left_out));
  return rest;
}

}  // namespace

Result<CameraRgb> balance_white(const CameraRgb& white) {
  const double least = std::ranges::min(white);
  if (!(least > 0.0)) return invalid_argument("white: a channel sees no light of it");
  return CameraRgb{white[1] / white[0], 1.0, white[1] / white[2]};
}

Result<ColorCorrection> fit_color(ColorModel model,
                                  const CameraRgb& white_balance,
                                  std::span<const CameraRgb> patches,
                                  std::span<const Lab> references) {
  const int n = term_count(model);
  if (patches.size() != references.size() || patches.size() < static_cast<std::size_t>(2 * n))
    return invalid_argument(
        "colour: expected a reference for each patch, and twice as many as terms");
  std::vector<Eigen::VectorXd> terms;
  Eigen::MatrixXd a(patches.size(), n);
  Eigen::MatrixXd b(patches.size(), 3);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    terms.push_back(terms_of(model, white_balance, patches[p]));
    const Xyz xyz = xyz_from_lab(references[p]);
    a.row(static_cast<Eigen::Index>(p)) = terms.back().transpose();
    b.row(static_cast<Eigen::Index>(p)) << xyz[0], xyz[1], xyz[2];
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(a);
  if (solver.rank() < n)
    return invalid_argument("colour: the patches are too much alike to tell the correction");
  Eigen::MatrixXd m = solver.solve(b).transpose();
  for (int step = 0; step < kLabSteps; ++step) {
    Eigen::MatrixXd next = m;
    if (!step_in_lab(next, terms, references)) break;
    if (!(lab_error(next, terms, references) < lab_error(m, terms, references))) break;
    m = next;
  }
  ColorCorrection correction{model, white_balance, {}};
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < n; ++column)
      correction.coefficients.push_back(m(row, column));
  }
  return correction;
}

Result<ColorError> leave_one_out(ColorModel model,
                                 const CameraRgb& white_balance,
                                 std::span<const CameraRgb> patches,
                                 std::span<const Lab> references,
                                 std::span<const std::vector<CameraRgb>> tests) {
  ColorError error;
  std::vector<double> all;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const auto fit = fit_color(model, white_balance, without(patches, p), without(references, p));
    if (!fit) return fit.error();
    const auto off = [&](const CameraRgb& rgb) {
      return delta_e_2000(lab_from_xyz(fit->xyz(rgb)), references[p]);
    };
    double sum = 0.0;
    if (tests.empty()) all.push_back(sum = off(patches[p]));
    for (const std::vector<CameraRgb>& test : tests) {
      if (test.size() != patches.size())
        return invalid_argument("colour: expected as many patches in every exposure");
      all.push_back(off(test[p]));
      sum += all.back() / static_cast<double>(tests.size());
    }
    error.patches.push_back(sum);
  }
  for (const double one : all) error.mean += one / static_cast<double>(all.size());
  std::ranges::sort(all);
  error.p95 = quantile_of_sorted(all, 0.95);
  error.most = all.back();
  return error;
}

std::array<int, 3> channel_order(std::span<const CameraRgb> patches,
                                 std::span<const Lab> references) {
  std::array<std::vector<double>, 3> seen;
  std::array<std::vector<double>, 3> true_ones;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const auto camera = shares(patches[p]);
    const auto reference = shares(rgb_of(references[p]));
    for (std::size_t c = 0; c < 3; ++c) {
      seen[c].push_back(camera[c]);
      true_ones[c].push_back(reference[c]);
    }
  }
  std::array<int, 3> order{0, 1, 2};
  std::array<int, 3> best = order;
  double most = -10.0;
  do {
    double sum = 0.0;
    for (std::size_t c = 0; c < 3; ++c)
      sum += correlation(seen[static_cast<std::size_t>(order[c])], true_ones[c]);
    if (sum > most) {
      most = sum;
      best = order;
    }
  } while (std::ranges::next_permutation(order).found);
  return best;
}

}  // namespace opaline::calibration
