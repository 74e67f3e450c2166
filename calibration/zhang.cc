#include "calibration/zhang.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace opaline::calibration {
namespace {

constexpr double kFieldOfView = 0.7;  // rad
constexpr double kOffMiddle = 1.0;  // of the picture's size: a projector's axis may lie at its edge

Eigen::Vector3d column_of(const Homography& h, std::size_t column) {
  return {h[column], h[3 + column], h[6 + column]};
}

// h_i' B h_j over (B11, B22, B13, B23, B33); B12 = 0 without skew.
Eigen::Matrix<double, 5, 1> constraint(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Matrix<double, 5, 1> v;
  v << a(0) * b(0), a(1) * b(1), a(0) * b(2) + a(2) * b(0), a(1) * b(2) + a(2) * b(1), a(2) * b(2);
  return v;
}

// Pixels to about -1 to 1, so that the entries of B are of one size.
Homography scaled(const Homography& h, const CameraModel& lens) {
  const double s = 2.0 / lens.width;
  Homography out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = s * (h[c] - lens.cx * h[6 + c]);
    out[3 + c] = s * (h[3 + c] - lens.cy * h[6 + c]);
    out[6 + c] = h[6 + c];
  }
  double norm = 0.0;
  for (const double v : out) norm += v * v;
  for (double& v : out) v /= std::sqrt(norm);
  return out;
}

bool solve_full(std::span<const Homography> views, CameraModel& lens) {
  if (views.size() < 3) return false;
  Eigen::MatrixXd rows(2 * static_cast<Eigen::Index>(views.size()), 5);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Homography h = scaled(views[i], lens);
    const Eigen::Vector3d a = column_of(h, 0);
    const Eigen::Vector3d b = column_of(h, 1);
    const auto row = 2 * static_cast<Eigen::Index>(i);
    rows.row(row) = constraint(a, b);
    rows.row(row + 1) = constraint(a, a) - constraint(b, b);
    rows.row(row).normalize();
    rows.row(row + 1).normalize();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullV);
  const Eigen::VectorXd b = svd.matrixV().col(4);
  const double cx = -b(2) / b(0);
  const double cy = -b(3) / b(1);
  const double lambda = b(4) - b(2) * b(2) / b(0) - b(3) * b(3) / b(1);
  if (!(lambda / b(0) > 0.0 && lambda / b(1) > 0.0)) return false;
  const double s = 0.5 * lens.width;
  CameraModel found = lens;
  found.fx = s * std::sqrt(lambda / b(0));
  found.fy = s * std::sqrt(lambda / b(1));
  found.cx = lens.cx + s * cx;
  found.cy = lens.cy + s * cy;
  const bool good = std::abs(found.cx - lens.cx) < kOffMiddle * lens.width &&
                    std::abs(found.cy - lens.cy) < kOffMiddle * lens.height &&
                    found.fx < 3.0 * found.fy && found.fy < 3.0 * found.fx;
  if (good) lens = found;
  return good;
}

// With the axis in the middle and fx = fy both constraints are linear in 1/f^2.
bool solve_focal(std::span<const Homography> views, CameraModel& lens) {
  double above = 0.0;
  double below = 0.0;
  for (const Homography& view : views) {
    const Homography h = scaled(view, lens);
    const Eigen::Vector3d a = column_of(h, 0);
    const Eigen::Vector3d b = column_of(h, 1);
    const std::array<std::array<double, 2>, 2> equations{
        {{a(0) * b(0) + a(1) * b(1), a(2) * b(2)},
         {a(0) * a(0) + a(1) * a(1) - b(0) * b(0) - b(1) * b(1), a(2) * a(2) - b(2) * b(2)}}};
    for (const auto& [by, constant] : equations) {
      above -= by * constant;
      below += by * by;
    }
  }
  if (!(above > 0.0 && below > 0.0)) return false;
  lens.fx = lens.fy = 0.5 * lens.width * std::sqrt(below / above);
  return lens.fx < 50.0 * lens.width;
}

}  // namespace

std::optional<Homography> board_homography(const Board& board, const BoardView& view) {
  std::vector<PlanePair> pairs;
  for (const BoardCorner& corner : view.corners) {
    const Vec3 p = board.corner(corner.id);
    pairs.push_back({{p.x, p.y}, corner.pixel});
  }
  return fit_homography(pairs);
}

CameraModel initial_lens(int width, int height, std::span<const Homography> views) {
  CameraModel lens;
  lens.width = width;
  lens.height = height;
  lens.cx = 0.5 * width;
  lens.cy = 0.5 * height;
  lens.fx = lens.fy = 0.5 * width / std::tan(0.5 * kFieldOfView);
  if (!solve_full(views, lens)) solve_focal(views, lens);
  return lens;
}

Pose initial_pose(const CameraModel& lens, const Homography& view) {
  const auto ray = [&](std::size_t c) {
    const Eigen::Vector3d h = column_of(view, c);
    return Eigen::Vector3d(
        (h(0) - lens.cx * h(2)) / lens.fx, (h(1) - lens.cy * h(2)) / lens.fy, h(2));
  };
  const Eigen::Vector3d a = ray(0);
  const Eigen::Vector3d b = ray(1);
  Eigen::Vector3d t = ray(2);
  const double sign = t(2) < 0.0 ? -1.0 : 1.0;  // in front of the camera
  const double scale = sign * 2.0 / (a.norm() + b.norm());
  t *= scale;
  Eigen::Matrix3d rough;
  rough.col(0) = scale * a;
  rough.col(1) = scale * b;
  rough.col(2) = rough.col(0).cross(rough.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rough, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d r = svd.matrixU() * svd.matrixV().transpose();
  return {{r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)},
          {t(0), t(1), t(2)}};
}

}  // namespace opaline::calibration
