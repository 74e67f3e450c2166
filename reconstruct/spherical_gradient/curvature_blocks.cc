#include "reconstruct/spherical_gradient/curvature_blocks.h"

#include <algorithm>
#include <cmath>

namespace opaline::reconstruct {
namespace {

constexpr double kBlocksInReach = 8.0;
constexpr double kFloor = 0.1;  // of the usual curvature
constexpr double kLeast = 1e-30;
constexpr double kLeastCount = 1e-6;  // sums over a picture have no more digits

double square(double x) { return x * x; }

}  // namespace

int CurvatureBlocks::side_for(double reach) {
  return static_cast<int>(std::clamp(reach / kBlocksInReach, 1.0, 1000.0));
}

CurvatureBlocks::CurvatureBlocks(const ScatteringMaps& maps, int side, ThreadTeam& team)
    : side_(side),
      floor_(std::max(kLeast, square(kFloor * quantile_of_answers(maps, maps.curvature, 0.5)))),
      width_((maps.width + side - 1) / side),
      height_((maps.height + side - 1) / side),
      sums_(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1), Sum{}) {
  const auto at = [&](int x, int y) -> Sum& {
    return sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                 static_cast<std::size_t>(x)];
  };
  team.run([&](int thread) {
    for (int y = thread; y < height_; y += team.size()) {
      Sum row{};
      for (int x = 0; x < width_; ++x) {
        const Sum here = block(maps, x, y);
        for (std::size_t k = 0; k < kTerms; ++k) row[k] += here[k];
        at(x + 1, y + 1) = row;
      }
    }
  });
  for (int y = 1; y < height_; ++y)
    for (int x = 1; x <= width_; ++x)
      for (std::size_t k = 0; k < kTerms; ++k) at(x, y + 1)[k] += at(x, y)[k];
}

CurvatureBlocks::Sum CurvatureBlocks::block(const ScatteringMaps& maps, int bx, int by) const {
  Sum sum{};
  for (int y = by * side_; y < std::min(maps.height, (by + 1) * side_); ++y)
    for (int x = bx * side_; x < std::min(maps.width, (bx + 1) * side_); ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(maps.width) +
                             static_cast<std::size_t>(x);
      if (maps.left_out[at] == LeftOut::kConcave) sum[kConcaves] += 1.0;
      const double h = maps.curvature[at];
      if (h == 0.0) continue;
      const double weight = floor_ / (floor_ + square(maps.curvature_deviation[at]));
      sum[kCount] += weight;
      sum[kH] += weight * h;
      sum[kHH] += weight * h * h;
    }
  // all pixels of a block stand in its middle
  const double x = bx;
  const double y = by;
  sum[kX] = x * sum[kCount];
  sum[kY] = y * sum[kCount];
  sum[kXX] = x * sum[kX];
  sum[kXY] = x * sum[kY];
  sum[kYY] = y * sum[kY];
  sum[kHX] = x * sum[kH];
  sum[kHY] = y * sum[kH];
  return sum;
}

CurvatureBlocks::Around CurvatureBlocks::around(int x, int y, double half) const {
  const int reach = std::max(1, static_cast<int>(half / side_));
  const int left = std::max(0, x / side_ - reach);
  const int right = std::min(width_, x / side_ + reach + 1);
  const int top = std::max(0, y / side_ - reach);
  const int bottom = std::min(height_, y / side_ + reach + 1);
  Sum s{};
  for (std::size_t k = 0; k < kTerms; ++k)
    s[k] = corner(right, bottom)[k] - corner(left, bottom)[k] - corner(right, top)[k] +
           corner(left, top)[k];
  Around around;
  around.concave = s[kConcaves];
  const double n = s[kCount];
  if (n < kLeastCount) return around;
  around.count = n;
  around.mean = s[kH] / n;
  around.variance = std::max(0.0, s[kHH] / n - around.mean * around.mean);
  const double xx = s[kXX] - s[kX] * s[kX] / n;
  const double xy = s[kXY] - s[kX] * s[kY] / n;
  const double yy = s[kYY] - s[kY] * s[kY] / n;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-6 * n * n)) return around;  // all in one line
  const double hx = s[kHX] - s[kX] * around.mean;
  const double hy = s[kHY] - s[kY] * around.mean;
  around.by_x = (yy * hx - xy * hy) / det / side_;
  around.by_y = (xx * hy - xy * hx) / det / side_;
  return around;
}

const CurvatureBlocks::Around& CurvatureBlocks::Walker::around(int x, int y, double half) {
  const int side = blocks_.side();
  const std::array<int, 3> at{x / side, y / side, static_cast<int>(half / side)};
  if (at != at_) last_ = blocks_.around(x, y, half);
  at_ = at;
  return last_;
}

double quantile_of_answers(const ScatteringMaps& maps,
                           const std::vector<float>& values,
                           double share) {
  constexpr std::size_t kSample = 10'000;
  std::vector<float> found;
  const std::size_t stride = std::max<std::size_t>(1, values.size() / kSample);
  for (std::size_t at = 0; at < values.size(); at += stride)
    if (maps.left_out[at] == LeftOut::kFound) found.push_back(values[at]);
  if (found.empty()) return 0.0;
  const auto place =
      found.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(found.size() - 1));
  std::ranges::nth_element(found, place);
  return *place;
}

}  // namespace opaline::reconstruct
