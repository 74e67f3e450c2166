#include "reconstruct/discrepancy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/ensure.h"

namespace opaline::reconstruct {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kMostAnAxis = 8;

MatrixXd cosines(int cells, int count) {
  MatrixXd c(cells, count);
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < cells; ++i)
      c(i, k) =
          (k == 0 ? 1.0 : std::numbers::sqrt2) * std::cos(std::numbers::pi * k * (i + 0.5) / cells);
  return c;
}

int count_of(int cells, double extent_mm, double length_mm) {
  return std::clamp(
      1 + static_cast<int>(extent_mm / length_mm + 1e-9), 1, std::min(cells, kMostAnAxis));
}

double root_mean_square(const ChannelIllumination& picture) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t x = 0; x < picture.weight.size(); ++x) {
    if (picture.weight[x] == 0.0) continue;
    sum += picture.radiance[x] * picture.radiance[x];
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

}  // namespace

DiscrepancyShapes::DiscrepancyShapes(const Block& block, Face seen_face, double length_mm) {
  ENSURE(length_mm > 0.0);
  const auto axis = static_cast<std::size_t>(axis_of(seen_face));
  const auto spacing = block.spacing();
  const int width = block.face_width(seen_face);
  const int height = block.face_height(seen_face);
  const MatrixXd u = cosines(width, count_of(width, width * spacing[axis == 0 ? 1 : 0], length_mm));
  const MatrixXd v =
      cosines(height, count_of(height, height * spacing[axis == 2 ? 1 : 2], length_mm));
  cosines_.resize(static_cast<Index>(width) * height, u.cols() * v.cols());
  for (Index b = 0; b < v.cols(); ++b)
    for (Index a = 0; a < u.cols(); ++a)
      for (Index y = 0; y < height; ++y)
        cosines_.col(b * u.cols() + a).segment(y * width, width) = v(y, b) * u.col(a);
  cosines_ /= std::sqrt(static_cast<double>(cosines_.cols()));
}

MatrixXd DiscrepancyShapes::whitened(const ChannelIllumination& picture) const {
  ENSURE(static_cast<Index>(picture.weight.size()) == cosines_.rows());
  const double level = root_mean_square(picture);
  Eigen::VectorXd scale(cosines_.rows());
  for (Index x = 0; x < scale.size(); ++x) {
    const auto at = static_cast<std::size_t>(x);
    scale[x] = std::sqrt(picture.weight[at]) * std::hypot(picture.radiance[at], level);
  }
  return scale.asDiagonal() * cosines_;
}

double mixing_length(const Block& block, Face seen_face) {
  const Vec3 size = block.size();
  return std::array{size.x, size.y, size.z}[static_cast<std::size_t>(axis_of(seen_face))];
}

}  // namespace opaline::reconstruct
