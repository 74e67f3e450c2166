#pragma once

#include <vector>

#include "reconstruct/host/buffer.h"
#include "reconstruct/host/host_grid.h"

namespace opaline::reconstruct::host {

/// Fields of `width` right-hand sides side by side over planes of cells. Each row is followed by a
/// cell of zeros, which nobody reads for its value, and the first row has one before it.
template <class T>
class HostField {
 public:
  HostField() = default;
  HostField(int nx, int ni, int planes, int width)
      : row_((static_cast<std::size_t>(nx) + 1) * width),
        plane_(row_ * ni),
        storage_(plane_ * planes + 2 * kGuard) {}

  T* row(int j, int k) { return data() + k * plane_ + j * row_; }
  const T* row(int j, int k) const { return data() + k * plane_ + j * row_; }
  T* cell(int i, int j, int k, int width) {
    return row(j, k) + static_cast<std::size_t>(i) * width;
  }
  const T* cell(int i, int j, int k, int width) const {
    return row(j, k) + static_cast<std::size_t>(i) * width;
  }
  T* plane(int k) { return data() + k * plane_; }
  const T* plane(int k) const { return data() + k * plane_; }
  std::size_t row_size() const { return row_; }
  std::size_t plane_size() const { return plane_; }

 private:
  static constexpr std::size_t kGuard = 32;
  T* data() { return storage_.data() + kGuard; }
  const T* data() const { return storage_.data() + kGuard; }
  std::size_t row_ = 0;
  std::size_t plane_ = 0;
  Buffer<T> storage_;
};

/// Cells along one axis that a tile answers for, and those around that it computes to do so.
struct Range {
  int begin;
  int end;
  int low;   ///< even
  int high;  ///< low <= begin, end <= high
  int size() const { return high - low; }
};

/// A column of cells, all planes of it: so narrow that the planes at work stay in the cache.
struct Tile {
  Range x;
  Range inner;
};

/// What one thread computes a level's tile in.
template <class T>
struct Scratch {
  HostField<T> ring;       ///< kRing planes of a tile
  HostField<T> below;      ///< kRing planes of its aggregates
  std::vector<T> discard;  ///< a row that takes what leaves the tile
};
constexpr int kRing = 5;

/// Cells of one colour in a line of nx, at most.
constexpr int half_line(int nx) { return (nx + 1) / 2; }

/// All fields of one group of right-hand sides, kept from solve to solve. Those of level 0 have the
/// black cells only, side by side: cell i of a line at i / 2.
template <class T, class S>
struct Workspace {
  Workspace(const HostGrid<T>& grid, int lanes, int threads);
  /// Whether it serves this grid, too.
  bool fits(const HostGrid<T>& grid) const;

  /// How many threads share a level: fewer where there is little to do.
  int parts(int level) const { return parts_[level]; }
  /// Lines of s that are updated while they are in the cache.
  int rows_at_work() const { return rows_at_work_; }

  int width;                                     ///< 1, 4, 8 or 16
  std::vector<HostField<T>> r;                   ///< one a level
  std::vector<HostField<S>> z;                   ///< one a level
  HostField<T> s, d, aside;                      ///< level 0; d is begun anew where aside is taken
  std::vector<std::vector<Tile>> tiles;          ///< [level]
  std::vector<std::vector<Scratch<T>>> scratch;  ///< [level][thread]
  std::vector<HostField<T>> halo;                ///< [thread]: s beyond the slab, four planes
  std::vector<HostField<T>> relaxed;   ///< [thread]: red cells while s is at work, kRelaxedPlanes
  std::vector<std::vector<T>> fields;  ///< [thread]: some lines, field by field
  std::vector<T> zeros;                ///< a row outside the grid, after two cells
  std::vector<S> stored_zeros;         ///< the same of z
  std::vector<double> rho_sums, energy_sums, norm_sums;  ///< [plane][tile][width]

 private:
  std::vector<std::array<int, 3>> sizes_;
  std::vector<int> parts_;
  int rows_at_work_ = 0;
};

/// Lines before a block of the update that it relaxes anew, and planes of relaxed cells kept. Both are even, as
/// rows_at_work() is: a row of `relaxed` always holds cells of one parity, and what follows a short one stays zero.
constexpr int kRelaxedAnew = 4;
constexpr int kRelaxedPlanes = 4;

}  // namespace opaline::reconstruct::host
