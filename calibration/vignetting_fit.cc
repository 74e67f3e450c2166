#include "calibration/vignetting_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

namespace opaline::calibration {
namespace {

constexpr double kMiddle = 0.25;     // of a square's side, each way from its middle
constexpr double kLeastSide = 10.0;  // px
constexpr int kTerms = 2;            // of each lens
constexpr int kUnknowns = 2 * kTerms;
constexpr int kSteps = 12;
constexpr int kFewest = 100;
constexpr double kOutlier = 4.0;
constexpr int kGrid = 16;  // places of the picture, each way, that the deviation is a mean over

using Terms = Eigen::Matrix<double, kUnknowns, 1>;

double r_squared(const CameraModel& lens, CameraModel::Pixel p) {
  const double x = 2.0 * p.x - lens.width;
  const double y = 2.0 * p.y - lens.height;
  return (x * x + y * y) / (1.0 * lens.width * lens.width + 1.0 * lens.height * lens.height);
}

/// A square as both lenses see it.
struct Square {
  std::size_t view = 0;
  double logarithm = 0.0;  // of its light, less that of cos theta / d^2
  std::array<double, 2> r2{};
};

std::vector<Square> squares_of(const PairFit& fit, std::span<const std::vector<PaperLight>> views) {
  std::vector<Square> squares;
  const Vec3 lamp = fit.joint_projector.centre();
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!fit.views[v].kept()) continue;
    const Pose& pose = fit.views[v].camera_from_board;
    const Vec3 away = pose.rotate({0.0, 0.0, 1.0});
    for (const PaperLight& paper : views[v]) {
      const Vec3 there = pose.apply(paper.place);
      const Vec3 ray = there - lamp;
      const double d = length(ray);
      const double cosine = dot(ray, away) / d;
      if (!(cosine > 0.0) || !(paper.light > 0.0)) continue;
      squares.push_back({v,
                         std::log(paper.light * d * d / cosine),
                         {r_squared(fit.joint_camera, fit.joint_camera.project(there)),
                          r_squared(fit.joint_projector, fit.joint_projector.project(there))}});
    }
  }
  return squares;
}

double vignetting(const Terms& terms, std::size_t lens, double r2) {
  const auto first = static_cast<Eigen::Index>(kTerms * lens);
  return 1.0 + r2 * (terms[first] + r2 * terms[first + 1]);
}

/// One linearisation, each view's mean taken out of all.
struct Equations {
  Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> slopes;
  Eigen::VectorXd off;
};

Equations linearised(const std::vector<Square>& squares, const Terms& terms, std::size_t views) {
  const auto n = static_cast<Eigen::Index>(squares.size());
  Equations e{Eigen::MatrixXd(n, kUnknowns), Eigen::VectorXd(n)};
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(views), kUnknowns + 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Square& s = squares[static_cast<std::size_t>(i)];
    e.off[i] = s.logarithm;
    for (std::size_t lens = 0; lens < 2; ++lens) {
      const double r2 = s.r2[lens];
      const double v = vignetting(terms, lens, r2);
      const auto first = static_cast<Eigen::Index>(kTerms * lens);
      e.off[i] -= std::log(v);
      e.slopes(i, first) = r2 / v;
      e.slopes(i, first + 1) = r2 * r2 / v;
    }
    auto mean = means.row(static_cast<Eigen::Index>(s.view));
    mean.head<kUnknowns>() += e.slopes.row(i);
    mean[kUnknowns] += e.off[i];
    mean[kUnknowns + 1] += 1.0;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto mean =
        means.row(static_cast<Eigen::Index>(squares[static_cast<std::size_t>(i)].view));
    e.slopes.row(i) -= mean.head<kUnknowns>() / mean[kUnknowns + 1];
    e.off[i] -= mean[kUnknowns] / mean[kUnknowns + 1];
  }
  return e;
}

bool is_positive(const std::vector<Square>& squares, const Terms& terms) {
  return std::ranges::all_of(squares, [&](const Square& s) {
    return vignetting(terms, 0, s.r2[0]) > 0.0 && vignetting(terms, 1, s.r2[1]) > 0.0;
  });
}

// False: none that is positive everywhere.
bool solve(const std::vector<Square>& squares, std::size_t views, Terms& terms) {
  for (int step = 0; step < kSteps; ++step) {
    const Equations e = linearised(squares, terms, views);
    terms += e.slopes.colPivHouseholderQr().solve(e.off);
    if (!terms.allFinite() || !is_positive(squares, terms)) return false;
  }
  return true;
}

double rms_of(const Eigen::VectorXd& off) {
  return std::sqrt(off.squaredNorm() / static_cast<double>(off.size()));
}

void leave_out_far(std::vector<Square>& squares, const Terms& terms, std::size_t views) {
  const Equations e = linearised(squares, terms, views);
  const double limit = kOutlier * rms_of(e.off);
  std::vector<Square> near;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (std::abs(e.off[static_cast<Eigen::Index>(i)]) <= limit) near.push_back(squares[i]);
  }
  squares = std::move(near);
}

using Covariance = Eigen::Matrix<double, kUnknowns, kUnknowns>;

double deviation_over_picture(const CameraModel& lens,
                              const Covariance& covariance,
                              std::size_t which) {
  const auto first = static_cast<Eigen::Index>(kTerms * which);
  const Eigen::Matrix2d own = covariance.block<kTerms, kTerms>(first, first);
  double sum = 0.0;
  for (int j = 0; j < kGrid; ++j) {
    for (int i = 0; i < kGrid; ++i) {
      const double r2 =
          r_squared(lens, {(i + 0.5) * lens.width / kGrid, (j + 0.5) * lens.height / kGrid});
      const Eigen::Vector2d slope(r2, r2 * r2);
      sum += slope.dot(own * slope);
    }
  }
  return std::sqrt(sum / (kGrid * kGrid));
}

using Corners = std::array<CameraModel::Pixel, 4>;  // of a square, one after the other around it

double least_side(const Corners& corners) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& next = corners[(k + 1) % 4];
    least = std::min(least, std::hypot(next.x - corners[k].x, next.y - corners[k].y));
  }
  return least;
}

// Where the diagonals cross: a square's middle, whatever the perspective.
CameraModel::Pixel middle_of(const Corners& c) {
  const double ux = c[2].x - c[0].x;
  const double uy = c[2].y - c[0].y;
  const double vx = c[3].x - c[1].x;
  const double vy = c[3].y - c[1].y;
  const double along = ((c[1].x - c[0].x) * vy - (c[1].y - c[0].y) * vx) / (ux * vy - uy * vx);
  return {c[0].x + along * ux, c[0].y + along * uy};
}

std::optional<double> mean_of_middle(const Image<float>& even, const Corners& corners) {
  const double side = least_side(corners);
  if (side < kLeastSide) return std::nullopt;
  const CameraModel::Pixel middle = middle_of(corners);
  const double reach = kMiddle * side;
  const auto first = [reach](double place) {
    return static_cast<int>(std::ceil(place - reach - 0.5));
  };
  const auto last = [reach](double place) {
    return static_cast<int>(std::floor(place + reach - 0.5));
  };
  double sum = 0.0;
  int count = 0;
  for (int y = std::max(0, first(middle.y)); y <= std::min(even.height() - 1, last(middle.y));
       ++y) {
    for (int x = std::max(0, first(middle.x)); x <= std::min(even.width() - 1, last(middle.x));
         ++x) {
      sum += even.at(x, y);
      ++count;
    }
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

// A board of which a half turn looks the same may have been taken for that: which squares are white is seen, not known.
double mean_light(const std::vector<PaperLight>& papers) {
  double sum = 0.0;
  for (const PaperLight& paper : papers) sum += paper.light;
  return papers.empty() ? 0.0 : sum / static_cast<double>(papers.size());
}

}  // namespace

std::vector<PaperLight> paper_light(const Image<float>& even,
                                    const BoardView& view,
                                    const Board& board) {
  if (board.kind != Board::Kind::kChessboard) return {};
  std::vector<std::optional<CameraModel::Pixel>> seen(
      static_cast<std::size_t>(board.corner_count()));
  for (const BoardCorner& corner : view.corners)
    seen[static_cast<std::size_t>(corner.id)] = corner.pixel;
  std::array<std::vector<PaperLight>, 2> by_colour;
  for (int row = 0; row + 1 < board.rows(); ++row) {
    for (int column = 0; column + 1 < board.columns(); ++column) {
      const int id = row * board.columns() + column;
      const auto corner = [&](int on) { return seen[static_cast<std::size_t>(id + on)]; };
      const std::array around{
          corner(0), corner(1), corner(board.columns() + 1), corner(board.columns())};
      if (!std::ranges::all_of(around, [](const auto& c) { return c.has_value(); })) continue;
      const auto light = mean_of_middle(even, {*around[0], *around[1], *around[2], *around[3]});
      if (!light) continue;
      const double half = 0.5 * board.square_mm;
      by_colour[static_cast<std::size_t>((row + column) % 2)].push_back(
          {board.corner(id) + Vec3{half, half, 0.0}, *light});
    }
  }
  return mean_light(by_colour[0]) > mean_light(by_colour[1]) ? by_colour[0] : by_colour[1];
}

double VignettingFit::at(std::size_t lens, double r_squared) const {
  const auto& v = coefficients[lens];
  return 1.0 + r_squared * (v[0] + r_squared * (v[1] + r_squared * v[2]));
}

Result<VignettingFit> fit_vignetting(const PairFit& fit,
                                     std::span<const std::vector<PaperLight>> views) {
  std::vector<Square> squares = squares_of(fit, views);
  if (squares.size() < kFewest)
    return invalid_argument(
        fmt::format("{} white squares; vignetting wants {}", squares.size(), kFewest));
  Terms terms = Terms::Zero();
  const bool solved = solve(squares, views.size(), terms);
  if (solved) leave_out_far(squares, terms, views.size());
  if (!solved || !solve(squares, views.size(), terms))
    return invalid_argument("no vignetting explains the light of the white squares");
  const Equations e = linearised(squares, terms, views.size());
  const double free = static_cast<double>(squares.size()) - kUnknowns - fit.kept();
  const Covariance covariance =
      e.off.squaredNorm() / free * (e.slopes.transpose() * e.slopes).inverse();
  VignettingFit found;
  found.coefficients = {{{terms[0], terms[1], 0.0}, {terms[2], terms[3], 0.0}}};
  found.deviation = {deviation_over_picture(fit.joint_camera, covariance, 0),
                     deviation_over_picture(fit.joint_projector, covariance, 1)};
  found.residual = rms_of(e.off);
  found.squares = static_cast<int>(squares.size());
  return found;
}

}  // namespace opaline::calibration
