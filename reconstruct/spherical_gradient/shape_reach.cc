#include "reconstruct/spherical_gradient/shape_reach.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::reconstruct {
namespace {

constexpr double kInterreflectionReach = 2.0;  // l_d
constexpr double kBendReach = 0.7;             // l_d: most of the light comes from within
constexpr int kMostReach = 400;                // pixels

/// Sums over rectangles of the picture: how many pixels have a curvature, its sum and its squares', and how many are concave.
class CurvatureSums {
 public:
  struct Square {
    double count = 0.0;
    double mean = 0.0;
    double variance = 0.0;
    double concave = 0.0;
  };
  explicit CurvatureSums(const ScatteringMaps& maps)
      : width_(maps.width), height_(maps.height), sums_(cells(width_ + 1) * cells(height_ + 1)) {
    for (int y = 0; y < height_; ++y) {
      Sum row{};
      for (int x = 0; x < width_; ++x) {
        const std::size_t at = cells(y) * cells(width_) + cells(x);
        const double h = maps.curvature[at];
        if (h != 0.0) {
          row[0] += 1.0;
          row[1] += h;
          row[2] += h * h;
        }
        if (maps.left_out[at] == LeftOut::kConcave) row[3] += 1.0;
        for (std::size_t k = 0; k < row.size(); ++k)
          sum_at(x + 1, y + 1)[k] = sum_at(x + 1, y)[k] + row[k];
      }
    }
  }
  Square around(int x, int y, int half) const {
    const int left = std::max(0, x - half);
    const int right = std::min(width_, x + half + 1);
    const int top = std::max(0, y - half);
    const int bottom = std::min(height_, y + half + 1);
    Sum sum{};
    for (std::size_t k = 0; k < sum.size(); ++k)
      sum[k] =
          get(right, bottom)[k] - get(left, bottom)[k] - get(right, top)[k] + get(left, top)[k];
    Square square{sum[0], 0.0, 0.0, sum[3]};
    if (sum[0] < 1.0) return square;
    square.mean = sum[1] / sum[0];
    square.variance = std::max(0.0, sum[2] / sum[0] - square.mean * square.mean);
    return square;
  }

 private:
  using Sum = std::array<double, 4>;
  static std::size_t cells(int n) { return static_cast<std::size_t>(n); }
  Sum& sum_at(int x, int y) { return sums_[cells(y) * cells(width_ + 1) + cells(x)]; }
  const Sum& get(int x, int y) const { return sums_[cells(y) * cells(width_ + 1) + cells(x)]; }

  int width_;
  int height_;
  std::vector<Sum> sums_;
};

void leave_out(std::size_t at, LeftOut reason, ScatteringMaps& maps) {
  maps.left_out[at] = reason;
  for (auto* map : {&maps.reduced_albedo,
                    &maps.diffusion,
                    &maps.translucency,
                    &maps.reduced_scattering,
                    &maps.absorption,
                    &maps.log_diffusion_deviation,
                    &maps.albedo_deviation})
    (*map)[at] = 0.0F;
}

}  // namespace

void account_for_shape(const GradientPictures& pictures, ThreadTeam& team, ScatteringMaps& maps) {
  const CurvatureSums sums(maps);
  team.run([&](int thread) {
    for (int y = thread; y < maps.height; y += team.size())
      for (int x = 0; x < maps.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(maps.width) +
                               static_cast<std::size_t>(x);
        if (maps.left_out[at] != LeftOut::kFound) continue;
        const double reach = maps.translucency[at] / pictures.pixel_mm;
        const auto half = [&](double share) {
          return static_cast<int>(std::clamp(share * reach, 1.0, 1.0 * kMostReach));
        };
        if (sums.around(x, y, half(kInterreflectionReach)).concave > 0.0) {
          leave_out(at, LeftOut::kInterreflection, maps);
          continue;
        }
        const auto near = sums.around(x, y, half(kBendReach));
        const double h = maps.curvature[at];
        const double off = near.mean - h;
        const double spread = (near.variance + off * off) / (h * h);
        const double stated = maps.log_diffusion_deviation[at];
        const double beyond_noise = std::max(0.0, spread - 2.0 * stated * stated);
        maps.log_diffusion_deviation[at] =
            static_cast<float>(std::sqrt(stated * stated + beyond_noise));
      }
  });
}

}  // namespace opaline::reconstruct
