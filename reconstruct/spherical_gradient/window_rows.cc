#include "reconstruct/spherical_gradient/window_rows.h"

#include <algorithm>
#include <cmath>

namespace opaline::reconstruct {
namespace {

/// What is summed down a column.
enum Down : std::size_t {
  kDownCount,
  kDownY,
  kDownYY,
  kDownNx,
  kDownNxY,
  kDownNy,
  kDownNyY,
  kDownNormalVariance,
  kDownRatio,
  kDownRatioVariance,
  kDownReflectance,
  kDownReflectanceVariance
};

/// sums[n] += weights[n] values[n], and y times as much to `moments`.
void add_with_moment(const double* __restrict weights,
                     const float* __restrict values,
                     double y,
                     std::size_t count,
                     double* __restrict sums,
                     double* __restrict moments) {
  for (std::size_t n = 0; n < count; ++n) {
    const double value = weights[n] * values[n];
    sums[n] += value;
    moments[n] += y * value;
  }
}

void add_weighted(const double* __restrict weights,
                  const float* __restrict values,
                  std::size_t count,
                  double* __restrict sums) {
  for (std::size_t n = 0; n < count; ++n) sums[n] += weights[n] * values[n];
}

}  // namespace

WindowPlanes::WindowPlanes(const Sums& s) {
  window_.count = static_cast<int>(std::lround(s[kCount]));
  if (window_.count < 6) return;
  const double n = s[kCount];
  const double each = 1.0 / n;
  x_ = s[kX] * each;
  y_ = s[kY] * each;
  const double xx = s[kXX] - s[kX] * x_;
  const double xy = s[kXY] - s[kX] * y_;
  const double yy = s[kYY] - s[kY] * y_;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-9 * n * n)) {
    window_.count = 0;  // all in one line
    return;
  }
  const double inverse = 1.0 / det;
  const auto slopes = [&](double by_x, double by_y) {
    return std::array<double, 2>{(yy * by_x - xy * by_y) * inverse,
                                 (xx * by_y - xy * by_x) * inverse};
  };
  slope_x_ = slopes(s[kNxX] - x_ * s[kNx], s[kNxY] - y_ * s[kNx]);
  slope_y_ = slopes(s[kNyX] - x_ * s[kNy], s[kNyY] - y_ * s[kNy]);
  mean_x_ = s[kNx] * each;
  mean_y_ = s[kNy] * each;
  const double noise = s[kNormalVariance] * each;  // of one pixel
  noise_by_count_ = noise * each;
  noise_xx_ = noise * inverse * xx;
  noise_xy_ = -2.0 * noise * inverse * xy;
  noise_yy_ = noise * inverse * yy;
  window_.curvature = static_cast<float>(0.5 * (slope_x_[0] + slope_y_[1]));
  window_.curvature_variance = static_cast<float>(0.25 * (noise_xx_ + noise_yy_));
  const double half = 0.5 * (slope_x_[0] - slope_y_[1]);
  window_.unevenness =
      static_cast<float>(half * half + slope_x_[1] * slope_y_[0] - window_.curvature_variance);
  window_.ratio = static_cast<float>(s[kRatio] * each);
  window_.ratio_variance = static_cast<float>(s[kRatioVariance] * each * each);
  window_.reflectance = static_cast<float>(s[kReflectance] * each);
  window_.reflectance_variance = static_cast<float>(s[kReflectanceVariance] * each * each);
}

int WindowRows::side_of(int half) {
  int side = 1;
  while (8 * side <= half) side *= 2;
  return side;
}

WindowRows::WindowRows(const PixelValues& pixels, int half, int begin)
    : p_(pixels),
      side_(side_of(half)),
      half_(half / side_),
      across_((pixels.width + side_ - 1) / side_),
      row_(begin / side_ - 1),
      origin_(begin),
      weights_(static_cast<std::size_t>(pixels.width)),
      cells_(static_cast<std::size_t>(across_)) {
  for (auto& sums : down_) sums.assign(static_cast<std::size_t>(p_.width), 0.0);
  add_rows(begin - half_ * side_, begin + half_ * side_, 1.0);
}

void WindowRows::advance() {
  ++row_;
  add_rows((row_ + half_) * side_, (row_ + half_ + 1) * side_, 1.0);
  const int gone = (row_ - half_ - 1) * side_;
  if (gone >= origin_ - half_ * side_) add_rows(gone, gone + side_, -1.0);
  sum_cells();
}

void WindowRows::add_rows(int begin, int end, double sign) {
  for (int y = std::max(0, begin); y < std::min(p_.height, end); ++y) add_row(y, sign);
}

void WindowRows::add_row(int y, double sign) {
  const auto count = static_cast<std::size_t>(p_.width);
  const std::size_t from = p_.index(0, y);
  const double j = y - origin_;
  for (std::size_t x = 0; x < count; ++x) {
    const double weight = p_.measured[from + x] != 0 ? sign : 0.0;
    weights_[x] = weight;
    down_[kDownCount][x] += weight;
    down_[kDownY][x] += j * weight;
    down_[kDownYY][x] += j * j * weight;
  }
  const double* const w = weights_.data();
  add_with_moment(w, &p_.normal_x[from], j, count, down_[kDownNx].data(), down_[kDownNxY].data());
  add_with_moment(w, &p_.normal_y[from], j, count, down_[kDownNy].data(), down_[kDownNyY].data());
  add_weighted(w, &p_.normal_variance[from], count, down_[kDownNormalVariance].data());
  add_weighted(w, &p_.ratio[from], count, down_[kDownRatio].data());
  add_weighted(w, &p_.ratio_variance[from], count, down_[kDownRatioVariance].data());
  add_weighted(w, &p_.reflectance[from], count, down_[kDownReflectance].data());
  add_weighted(w, &p_.reflectance_variance[from], count, down_[kDownReflectanceVariance].data());
}

void WindowRows::sum_cells() {
  using P = WindowPlanes;
  for (int cell = 0; cell < across_; ++cell) {
    Sums sums{};
    for (int x = cell * side_; x < std::min(p_.width, (cell + 1) * side_); ++x) {
      const auto at = static_cast<std::size_t>(x);
      const double count = down_[kDownCount][at];
      const double nx = down_[kDownNx][at];
      const double ny = down_[kDownNy][at];
      sums[P::kCount] += count;
      sums[P::kX] += x * count;
      sums[P::kXX] += x * (x * count);
      sums[P::kY] += down_[kDownY][at];
      sums[P::kXY] += x * down_[kDownY][at];
      sums[P::kYY] += down_[kDownYY][at];
      sums[P::kNx] += nx;
      sums[P::kNxX] += x * nx;
      sums[P::kNxY] += down_[kDownNxY][at];
      sums[P::kNy] += ny;
      sums[P::kNyX] += x * ny;
      sums[P::kNyY] += down_[kDownNyY][at];
      sums[P::kNormalVariance] += down_[kDownNormalVariance][at];
      sums[P::kRatio] += down_[kDownRatio][at];
      sums[P::kRatioVariance] += down_[kDownRatioVariance][at];
      sums[P::kReflectance] += down_[kDownReflectance][at];
      sums[P::kReflectanceVariance] += down_[kDownReflectanceVariance][at];
    }
    cells_[static_cast<std::size_t>(cell)] = sums;
  }
}

}  // namespace opaline::reconstruct
