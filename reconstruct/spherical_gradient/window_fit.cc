#include "reconstruct/spherical_gradient/window_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

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

/// Adds a pixel; rows count from `origin`, so that sums stay small.
void add_pixel(const PixelValues& p, int x, int y, int origin, double sign, Sums& sums) {
  const std::size_t at = p.index(x, y);
  if (p.measured[at] == 0) return;
  const double j = y - origin;
  const double nx = p.normal_x[at];
  const double ny = p.normal_y[at];
  const double i = x;
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
       p.normal_variance[at],
       p.ratio[at],
       p.ratio_variance[at],
       p.reflectance[at],
       p.reflectance_variance[at]},
      sign);
}

/// At a pixel, rows counted as in the sums.
WindowValues fitted(const Sums& s, double at_x, double at_y) {
  WindowValues w;
  w.count = static_cast<int>(std::lround(s[kCount]));
  if (w.count < 6) return w;
  const double n = s[kCount];
  const double x = s[kX] / n;
  const double y = s[kY] / n;
  const double xx = s[kXX] - n * x * x;
  const double xy = s[kXY] - n * x * y;
  const double yy = s[kYY] - n * y * y;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-9 * n * n)) {
    w.count = 0;  // all in one line
    return w;
  }
  const double nx_x = s[kNxX] - x * s[kNx];
  const double nx_y = s[kNxY] - y * s[kNx];
  const double ny_x = s[kNyX] - x * s[kNy];
  const double ny_y = s[kNyY] - y * s[kNy];
  w.curvature = 0.5 * (yy * nx_x - xy * nx_y + xx * ny_y - xy * ny_x) / det;
  const double noise = s[kNormalVariance] / n;  // of one pixel
  w.curvature_variance = 0.25 * noise * (xx + yy) / det;
  const double dx = at_x - x;
  const double dy = at_y - y;
  w.normal_x = s[kNx] / n + ((yy * nx_x - xy * nx_y) * dx + (xx * nx_y - xy * nx_x) * dy) / det;
  w.normal_y = s[kNy] / n + ((yy * ny_x - xy * ny_y) * dx + (xx * ny_y - xy * ny_x) * dy) / det;
  w.normal_variance = noise * (1.0 / n + (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det);
  w.ratio = s[kRatio] / n;
  w.ratio_variance = s[kRatioVariance] / (n * n);
  w.reflectance = s[kReflectance] / n;
  w.reflectance_variance = s[kReflectanceVariance] / (n * n);
  return w;
}

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
  team.run([&](int thread) {
    const int begin = p.height * thread / team.size();
    const int end = p.height * (thread + 1) / team.size();
    std::vector<Sums> columns(static_cast<std::size_t>(p.width), Sums{});
    const auto row = [&](int y, double sign) {
      for (int x = 0; x < p.width; ++x) add_pixel(p, x, y, begin, sign, columns[x]);
    };
    for (int y = std::max(0, begin - half); y < std::min(p.height, begin + half); ++y) row(y, 1.0);
    for (int y = begin; y < end; ++y) {
      if (y + half < p.height) row(y + half, 1.0);
      if (y - half - 1 >= std::max(0, begin - half)) row(y - half - 1, -1.0);
      Sums window{};
      for (int x = 0; x < std::min(p.width, half); ++x) add(window, columns[x], 1.0);
      for (int x = 0; x < p.width; ++x) {
        if (x + half < p.width) add(window, columns[x + half], 1.0);
        if (x - half - 1 >= 0) add(window, columns[x - half - 1], -1.0);
        if (p.measured[p.index(x, y)] != 0) f(x, y, fitted(window, x, y - begin));
      }
    }
  });
}

}  // namespace opaline::reconstruct
