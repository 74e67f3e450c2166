#include "render/graph/nearest.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {
namespace {

/// Places sorted into the cells of a grid, about four to a cell of an evenly filled box.
class Bins {
 public:
  explicit Bins(std::span<const Vec3> places) : places_(places) {
    const Box box = bounds({{places.begin(), places.end()}, {}});
    low_ = box.low;
    const Vec3 size = box.size();
    cell_ = std::max(std::cbrt(4.0 * size.x * size.y * size.z / static_cast<double>(places.size())),
                     1e-9 + 1e-3 * std::max({size.x, size.y, size.z}));
    counts_ = {extent(size.x), extent(size.y), extent(size.z)};
    cells_.resize(static_cast<std::size_t>(counts_[0]) * counts_[1] * counts_[2]);
    for (std::size_t i = 0; i < places.size(); ++i)
      cells_[cell_of(places[i])].push_back(static_cast<int>(i));
  }

  struct Found {
    double squared = 0.0;
    int place = 0;
  };

  /// The nearest, nearest first.
  void find(Vec3 p, std::size_t count, std::vector<Found>& found) const {
    found.clear();
    const auto at = indices(p);
    const int widest = std::max({counts_[0], counts_[1], counts_[2]});
    for (int ring = 0; ring <= widest; ++ring) {
      visit_ring(at, ring, p, found);
      if (found.size() < count) continue;
      std::ranges::partial_sort(
          found, found.begin() + static_cast<long>(count), {}, &Found::squared);
      const double safe = ring * cell_;  // all that is nearer has been seen
      if (found[count - 1].squared <= safe * safe) break;
    }
    std::ranges::sort(found, {}, &Found::squared);
    found.resize(std::min(found.size(), count));
  }

 private:
  int extent(double size) const { return static_cast<int>(size / cell_) + 1; }

  std::array<int, 3> indices(Vec3 p) const {
    const Vec3 q = (p - low_) * (1.0 / cell_);
    const auto clamped = [](double x, int n) {
      return static_cast<int>(std::clamp(x, 0.0, n - 1.0));
    };
    return {clamped(q.x, counts_[0]), clamped(q.y, counts_[1]), clamped(q.z, counts_[2])};
  }

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * counts_[1] + j) * counts_[0] + i;
  }

  std::size_t cell_of(Vec3 p) const {
    const auto at = indices(p);
    return index(at[0], at[1], at[2]);
  }

  void visit_ring(const std::array<int, 3>& at, int ring, Vec3 p, std::vector<Found>& found) const {
    for (int k = std::max(at[2] - ring, 0); k <= std::min(at[2] + ring, counts_[2] - 1); ++k) {
      for (int j = std::max(at[1] - ring, 0); j <= std::min(at[1] + ring, counts_[1] - 1); ++j) {
        const bool rim = std::abs(k - at[2]) == ring || std::abs(j - at[1]) == ring;
        const int step = rim || ring == 0 ? 1 : 2 * ring;
        for (int i = at[0] - ring; i <= at[0] + ring; i += step) {
          if (i < 0 || i >= counts_[0]) continue;
          for (const int place : cells_[index(i, j, k)]) {
            const Vec3 gap = places_[place] - p;
            found.push_back({dot(gap, gap), place});
          }
        }
      }
    }
  }

  std::span<const Vec3> places_;
  Vec3 low_;
  double cell_ = 1.0;
  std::array<int, 3> counts_{};
  std::vector<std::vector<int>> cells_;
};

}  // namespace

Interpolation<float> nearest_interpolation(std::span<const Vec3> from,
                                           std::span<const Vec3> to,
                                           int count) {
  const Bins bins(from);
  Interpolation<float> interpolation;
  interpolation.coarse_rows = static_cast<int>(from.size());
  std::vector<Bins::Found> found;
  for (const Vec3& p : to) {
    bins.find(p, static_cast<std::size_t>(count), found);
    double sum = 0.0;
    for (const auto& f : found) sum += 1.0 / std::max(f.squared, 1e-30);
    for (const auto& f : found) {
      interpolation.columns.push_back(f.place);
      interpolation.weights.push_back(static_cast<float>(1.0 / std::max(f.squared, 1e-30) / sum));
    }
    interpolation.starts.push_back(static_cast<int>(interpolation.columns.size()));
  }
  return interpolation;
}

}  // namespace opaline::render
