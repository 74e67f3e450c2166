#include "render/deform/cage.h"

#include <algorithm>

namespace opaline::render {
namespace {

constexpr int kMostPoints = 8;

/// Bernstein polynomials of degree n - 1, by de Casteljau's recursion.
std::array<double, kMostPoints> bernstein(double s, int n) {
  std::array<double, kMostPoints> b{1.0};
  for (int degree = 1; degree < n; ++degree) {
    for (int i = degree; i > 0; --i) b[i] = s * b[i - 1] + (1.0 - s) * b[i];
    b[0] *= 1.0 - s;
  }
  return b;
}

}  // namespace

Cage::Cage(const DeformOptions& options, const Box& bounds)
    : points_(options.points), box_(bounds) {
  const auto& n = points_;
  moves_.resize(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  const auto covers = [](int handle, int place) { return handle < 0 || handle == place; };
  for (const CageHandle& handle : options.handles) {
    std::size_t at = 0;
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i, ++at) {
          if (covers(handle.point[0], i) && covers(handle.point[1], j) &&
              covers(handle.point[2], k)) {
            moves_[at] = moves_[at] + handle.move * options.amount;
          }
        }
      }
    }
  }
}

Vec3 Cage::at(Vec3 rest) const {
  const Vec3 size = box_.size();
  const Vec3 from = rest - box_.low;
  const auto x = bernstein(from.x / std::max(size.x, 1e-300), points_[0]);
  const auto y = bernstein(from.y / std::max(size.y, 1e-300), points_[1]);
  const auto z = bernstein(from.z / std::max(size.z, 1e-300), points_[2]);
  Vec3 sum = rest;
  std::size_t at = 0;
  for (int k = 0; k < points_[2]; ++k) {
    for (int j = 0; j < points_[1]; ++j) {
      for (int i = 0; i < points_[0]; ++i, ++at) sum = sum + moves_[at] * (x[i] * y[j] * z[k]);
    }
  }
  return sum;
}

}  // namespace opaline::render
