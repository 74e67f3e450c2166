#include "reconstruct/spherical_gradient/window_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace opaline::reconstruct {
namespace {

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

void add(Sums& sums, const Sums& more, double sign) {
  for (std::size_t n = 0; n < kSums; ++n) sums[n] += sign * more[n];
}

/// Power of two.
int cell_side(int half) {
  int side = 1;
  while (8 * side <= half) side *= 2;
  return side;
}

/// Planes over a window, about the middle of what is in it.
class WindowPlanes {
 public:
  explicit WindowPlanes(const Sums& s) {
    window_.count = static_cast<int>(std::lround(s[kCount]));
    if (window_.count < 6) return;
    const double n = s[kCount];
    x_ = s[kX] / n;
    y_ = s[kY] / n;
    xx_ = s[kXX] - n * x_ * x_;
    xy_ = s[kXY] - n * x_ * y_;
    yy_ = s[kYY] - n * y_ * y_;
    det_ = xx_ * yy_ - xy_ * xy_;
    if (!(det_ > 1e-9 * n * n)) {
      window_.count = 0;  // all in one line
      return;
    }
    slope_x_ = slopes(s[kNxX] - x_ * s[kNx], s[kNxY] - y_ * s[kNx]);
    slope_y_ = slopes(s[kNyX] - x_ * s[kNy], s[kNyY] - y_ * s[kNy]);
    mean_x_ = s[kNx] / n;
    mean_y_ = s[kNy] / n;
    noise_ = s[kNormalVariance] / n;  // of one pixel
    window_.curvature = static_cast<float>(0.5 * (slope_x_[0] + slope_y_[1]));
    window_.curvature_variance = static_cast<float>(0.25 * noise_ * (xx_ + yy_) / det_);
    const double half = 0.5 * (slope_x_[0] - slope_y_[1]);
    window_.unevenness =
        static_cast<float>(half * half + slope_x_[1] * slope_y_[0] - window_.curvature_variance);
    window_.ratio = static_cast<float>(s[kRatio] / n);
    window_.ratio_variance = static_cast<float>(s[kRatioVariance] / (n * n));
    window_.reflectance = static_cast<float>(s[kReflectance] / n);
    window_.reflectance_variance = static_cast<float>(s[kReflectanceVariance] / (n * n));
  }
  /// With the normal at a pixel.
  const WindowValues& at(double x, double y) {
    if (window_.count < 6) return window_;
    const double dx = x - x_;
    const double dy = y - y_;
    window_.normal_x = static_cast<float>(mean_x_ + slope_x_[0] * dx + slope_x_[1] * dy);
    window_.normal_y = static_cast<float>(mean_y_ + slope_y_[0] * dx + slope_y_[1] * dy);
    window_.normal_variance =
        static_cast<float>(noise_ * (1.0 / window_.count +
                                     (yy_ * dx * dx - 2.0 * xy_ * dx * dy + xx_ * dy * dy) / det_));
    return window_;
  }

 private:
  std::array<double, 2> slopes(double by_x, double by_y) const {
    return {(yy_ * by_x - xy_ * by_y) / det_, (xx_ * by_y - xy_ * by_x) / det_};
  }

  WindowValues window_;
  double x_ = 0.0, y_ = 0.0, xx_ = 0.0, xy_ = 0.0, yy_ = 0.0, det_ = 1.0;
  double mean_x_ = 0.0, mean_y_ = 0.0, noise_ = 0.0;
  std::array<double, 2> slope_x_{};
  std::array<double, 2> slope_y_{};
};

/// The cells of one thread's rows, and what slides over them.
class CellRows {
 public:
  CellRows(const PixelValues& p, int half, int begin)
      : p_(p),
        side_(cell_side(half)),
        half_(half / side_),
        across_((p.width + side_ - 1) / side_),
        down_((p.height + side_ - 1) / side_),
        begin_(begin),
        ring_(static_cast<std::size_t>(2 * half_ + 2)),
        columns_(static_cast<std::size_t>(across_), Sums{}) {
    for (int row = std::max(0, begin - half_); row < std::min(down_, begin + half_); ++row)
      enter(row);
  }
  /// Moves on to a row of cells, one after the other from `begin` on.
  void move_to(int row) {
    if (row + half_ < down_) enter(row + half_);
    const int gone = row - half_ - 1;
    if (gone >= std::max(0, begin_ - half_)) {
      const auto& sums = stored(gone);
      for (std::size_t n = 0; n < columns_.size(); ++n) add(columns_[n], sums[n], -1.0);
    }
    window_ = {};
    for (int n = 0; n < std::min(across_, half_); ++n) add(window_, column(n), 1.0);
  }
  /// The window of a cell of that row, one after the other from 0 on.
  const Sums& window(int cell) {
    if (cell + half_ < across_) add(window_, column(cell + half_), 1.0);
    if (cell - half_ - 1 >= 0) add(window_, column(cell - half_ - 1), -1.0);
    return window_;
  }
  int side() const { return side_; }
  int across() const { return across_; }
  int origin() const {
    return begin_ * side_;
  }  ///< rows of pixels count from it, so that sums stay small

 private:
  const Sums& column(int n) const { return columns_[static_cast<std::size_t>(n)]; }
  std::vector<Sums>& stored(int row) { return ring_[static_cast<std::size_t>(row) % ring_.size()]; }
  void enter(int row) {
    std::vector<Sums>& sums = stored(row);
    sums.assign(columns_.size(), Sums{});
    for (int y = row * side_; y < std::min(p_.height, (row + 1) * side_); ++y)
      for (int n = 0; n < across_; ++n)
        for (int x = n * side_; x < std::min(p_.width, (n + 1) * side_); ++x)
          add_pixel(x, y, sums[static_cast<std::size_t>(n)]);
    for (std::size_t n = 0; n < columns_.size(); ++n) add(columns_[n], sums[n], 1.0);
  }
  void add_pixel(int x, int y, Sums& sums) const {
    const std::size_t at = p_.index(x, y);
    if (p_.measured[at] == 0) return;
    const double i = x;
    const double j = y - origin();
    const double nx = p_.normal_x[at];
    const double ny = p_.normal_y[at];
    add(sums,
        {1.0,
         i,
         j,
         i * i,
         i * j,
         j * j,
         nx,
         nx * i,
         nx * j,
         ny,
         ny * i,
         ny * j,
         p_.normal_variance[at],
         p_.ratio[at],
         p_.ratio_variance[at],
         p_.reflectance[at],
         p_.reflectance_variance[at]},
        1.0);
  }

  const PixelValues& p_;
  int side_;
  int half_;  // cells
  int across_;
  int down_;
  int begin_;
  std::vector<std::vector<Sums>> ring_;
  std::vector<Sums> columns_;
  Sums window_{};
};

}  // namespace

PixelValues::PixelValues(int w, int h) : width(w), height(h) {
  const std::size_t count = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
  for (auto* values : {&normal_x,
                       &normal_y,
                       &normal_variance,
                       &ratio,
                       &ratio_variance,
                       &reflectance,
                       &reflectance_variance})
    values->assign(count, 0.0F);
  measured.assign(count, 0);
}

void for_each_window(const PixelValues& p,
                     int half,
                     ThreadTeam& team,
                     const std::function<void(int x, int y, const WindowValues& window)>& f) {
  for_each_window(
      p, half, [](std::size_t) { return true; }, team, f);
}

void for_each_window(const PixelValues& p,
                     int half,
                     const std::function<bool(std::size_t at)>& wanted,
                     ThreadTeam& team,
                     const std::function<void(int x, int y, const WindowValues& window)>& f) {
  const int down = (p.height + cell_side(half) - 1) / cell_side(half);
  team.run([&](int thread) {
    const int begin = down * thread / team.size();
    const int end = down * (thread + 1) / team.size();
    CellRows rows(p, half, begin);
    const int side = rows.side();
    for (int row = begin; row < end; ++row) {
      rows.move_to(row);
      for (int cell = 0; cell < rows.across(); ++cell) {
        const Sums& sums = rows.window(cell);
        std::optional<WindowPlanes> planes;
        for (int y = row * side; y < std::min(p.height, (row + 1) * side); ++y)
          for (int x = cell * side; x < std::min(p.width, (cell + 1) * side); ++x) {
            const std::size_t at = p.index(x, y);
            if (p.measured[at] == 0 || !wanted(at)) continue;
            if (!planes) planes.emplace(sums);
            f(x, y, planes->at(x, y - rows.origin()));
          }
      }
    }
  });
}

}  // namespace opaline::reconstruct
