#include "calibration/homography.h"

#include <Eigen/Dense>
#include <cmath>

namespace opaline::calibration {
namespace {

constexpr double kDegenerate = 1e-9;

// To a mean of zero and a mean distance of sqrt(2).
struct Normaliser {
  double x = 0.0;
  double y = 0.0;
  double scale = 1.0;
  Eigen::Vector2d operator()(CameraModel::Pixel p) const {
    return {(p.x - x) * scale, (p.y - y) * scale};
  }
  Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m;
    m << scale, 0.0, -scale * x, 0.0, scale, -scale * y, 0.0, 0.0, 1.0;
    return m;
  }
};

template <class Side>
Normaliser normaliser_of(std::span<const PlanePair> pairs, Side side) {
  Normaliser n;
  for (const PlanePair& pair : pairs) {
    n.x += side(pair).x / static_cast<double>(pairs.size());
    n.y += side(pair).y / static_cast<double>(pairs.size());
  }
  double distance = 0.0;
  for (const PlanePair& pair : pairs)
    distance += std::hypot(side(pair).x - n.x, side(pair).y - n.y);
  if (distance > 0.0) n.scale = std::sqrt(2.0) * static_cast<double>(pairs.size()) / distance;
  return n;
}

}  // namespace

std::optional<Homography> fit_homography(std::span<const PlanePair> pairs) {
  if (pairs.size() < 4) return std::nullopt;
  const Normaliser from = normaliser_of(pairs, [](const PlanePair& p) { return p.from; });
  const Normaliser to = normaliser_of(pairs, [](const PlanePair& p) { return p.to; });
  using Row = Eigen::Matrix<double, 9, 1>;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PlanePair& pair : pairs) {
    const Eigen::Vector2d p = from(pair.from);
    const Eigen::Vector2d q = to(pair.to);
    Row a;
    Row b;
    a << p.x(), p.y(), 1.0, 0.0, 0.0, 0.0, -q.x() * p.x(), -q.x() * p.y(), -q.x();
    b << 0.0, 0.0, 0.0, p.x(), p.y(), 1.0, -q.y() * p.x(), -q.y() * p.y(), -q.y();
    normal += pair.weight * (a * a.transpose() + b * b.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  if (eigen.eigenvalues()(1) < kDegenerate * eigen.eigenvalues()(8)) return std::nullopt;
  const Row h = eigen.eigenvectors().col(0);
  Eigen::Matrix3d middle;
  middle << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
  Eigen::Matrix3d whole = to.matrix().inverse() * middle * from.matrix();
  if (std::abs(whole(2, 2)) > kDegenerate * whole.norm()) whole /= whole(2, 2);
  Homography out{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      out[static_cast<std::size_t>(3 * row + column)] = whole(row, column);
  }
  return out;
}

CameraModel::Pixel carry(const Homography& h, CameraModel::Pixel from) {
  const double w = h[6] * from.x + h[7] * from.y + h[8];
  return {(h[0] * from.x + h[1] * from.y + h[2]) / w, (h[3] * from.x + h[4] * from.y + h[5]) / w};
}

}  // namespace opaline::calibration
