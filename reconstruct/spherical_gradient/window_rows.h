#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::reconstruct {

/// Planes over a window, about the middle of what is in it.
class WindowPlanes {
 public:
  enum Sum : std::size_t {
    kCount,
    kX,
    kY,
    kXX,
    kXY,
    kYY,
    kNx,
    kNxX,
    kNxY,
    kNy,
    kNyX,
    kNyY,
    kNormalVariance,
    kRatio,
    kRatioVariance,
    kReflectance,
    kReflectanceVariance,
    kSums
  };
  using Sums = std::array<double, kSums>;

  explicit WindowPlanes(const Sums& sums);
  /// With the normal at a place, in the coordinates of the sums.
  const WindowValues& at(double x, double y) {
    if (window_.count < 6) return window_;
    const double dx = x - x_;
    const double dy = y - y_;
    window_.normal_x = static_cast<float>(mean_x_ + slope_x_[0] * dx + slope_x_[1] * dy);
    window_.normal_y = static_cast<float>(mean_y_ + slope_y_[0] * dx + slope_y_[1] * dy);
    window_.normal_variance = static_cast<float>(noise_by_count_ + noise_yy_ * dx * dx +
                                                 noise_xy_ * dx * dy + noise_xx_ * dy * dy);
    return window_;
  }

 private:
  WindowValues window_;
  double x_ = 0.0, y_ = 0.0, mean_x_ = 0.0, mean_y_ = 0.0;
  double noise_by_count_ = 0.0, noise_xx_ = 0.0, noise_xy_ = 0.0, noise_yy_ = 0.0;
  std::array<double, 2> slope_x_{};
  std::array<double, 2> slope_y_{};
};

/// Square windows over some rows of a picture, from above to below: sums down every column of pixels slide from one row of cells to the next, and along a row
/// windows slide over sums of cells. Cells are of half/4 pixels (a power of two) from half = 8 on, else of one.
/// Threads: one at a time per object; `pixels` must outlive it.
class WindowRows {
 public:
  /// Rows of pixels from `begin` on, a multiple of side_of(half).
  WindowRows(const PixelValues& pixels, int half, int begin);
  static int side_of(int half);
  int side() const { return side_; }

  /// The next row of cells, and those after it.
  void advance();
  /// Calls f(x, y, window) for the measured and wanted pixels of that row of cells.
  template <class Wanted, class F>
  void for_each(const Wanted& wanted, const F& f) {
    Sums window{};
    for (int n = 0; n < std::min(across_, half_); ++n) add(window, column(n), 1.0);
    const int below = std::min(p_.height, (row_ + 1) * side_);
    for (int cell = 0; cell < across_; ++cell) {
      if (cell + half_ < across_) add(window, column(cell + half_), 1.0);
      if (cell - half_ - 1 >= 0) add(window, column(cell - half_ - 1), -1.0);
      if (!is_wanted(cell, below, wanted)) continue;
      WindowPlanes planes(window);
      const int right = std::min(p_.width, (cell + 1) * side_);
      for (int y = row_ * side_; y < below; ++y)
        for (int x = cell * side_; x < right; ++x) {
          const std::size_t at = p_.index(x, y);
          if (p_.measured[at] != 0 && wanted(at)) f(x, y, planes.at(x, y - origin_));
        }
    }
  }

 private:
  using Sums = WindowPlanes::Sums;
  static constexpr std::size_t kDown = 12;  // sums down a column; x is the same all along it

  static void add(Sums& sums, const Sums& more, double sign) {
    for (std::size_t n = 0; n < sums.size(); ++n) sums[n] += sign * more[n];
  }
  template <class Wanted>
  bool is_wanted(int cell, int below, const Wanted& wanted) const {
    const int right = std::min(p_.width, (cell + 1) * side_);
    for (int y = row_ * side_; y < below; ++y)
      for (int x = cell * side_; x < right; ++x)
        if (p_.measured[p_.index(x, y)] != 0 && wanted(p_.index(x, y))) return true;
    return false;
  }
  const Sums& column(int n) const { return cells_[static_cast<std::size_t>(n)]; }
  void add_rows(int begin, int end, double sign);
  void add_row(int y, double sign);
  void sum_cells();

  const PixelValues& p_;
  int side_;
  int half_;                     // cells
  int across_;                   // cells
  int row_;                      // of cells
  int origin_;                   // rows of pixels count from it, so that sums stay small
  std::vector<double> weights_;  // of one row
  std::array<std::vector<double>, kDown> down_;
  std::vector<Sums> cells_;
};

}  // namespace opaline::reconstruct
