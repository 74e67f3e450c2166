#pragma once

#include <vector>

#include "reconstruct/host/buffer.h"
#include "reconstruct/host/host_grid.h"

namespace opaline::reconstruct::host {

/// Fields of `width` right-hand sides side by side over one level. Each row is followed by a cell
/// of zeros, which nobody writes, and the first row has one before it.
class HostField {
 public:
  HostField() = default;
  HostField(const HostLevel& level, int planes, int width);

  float* row(int j, int k) { return data() + k * plane_ + j * row_; }
  const float* row(int j, int k) const { return data() + k * plane_ + j * row_; }
  float* plane(int k) { return data() + k * plane_; }
  const float* plane(int k) const { return data() + k * plane_; }
  std::size_t row_size() const { return row_; }
  std::size_t plane_size() const { return plane_; }

 private:
  static constexpr std::size_t kGuard = 16;
  float* data() { return storage_.data() + kGuard; }
  const float* data() const { return storage_.data() + kGuard; }
  std::size_t row_ = 0;
  std::size_t plane_ = 0;
  Buffer<float> storage_;
};

/// All fields of one group of right-hand sides, kept from solve to solve.
struct Workspace {
  Workspace(const HostGrid& grid, int lanes, int threads);
  /// Whether it serves this grid, too.
  bool fits(const HostGrid& grid) const;

  /// How many threads share a level: fewer where there is little to do.
  int parts(int level) const { return parts_[level]; }

  int width;                                    ///< 1, 4, 8 or 16
  std::vector<HostField> r;                     ///< one a level
  std::vector<HostField> z;                     ///< one a level
  HostField p, q, d;                            ///< level 0
  std::vector<std::vector<HostField>> scratch;  ///< [level][thread]: four planes
  std::vector<std::vector<float>> discard;      ///< [thread]: a row that takes what leaves the slab
  std::vector<float> zeros;                     ///< a row outside the grid
  std::vector<double> plane_sums;               ///< [plane][width]

 private:
  std::vector<std::array<int, 3>> sizes_;
  std::vector<int> parts_;
};

}  // namespace opaline::reconstruct::host
