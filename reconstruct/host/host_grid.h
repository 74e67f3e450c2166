#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/level_builder.h"
#include "reconstruct/diffusion/multigrid.h"
#include "reconstruct/host/buffer.h"

namespace opaline::reconstruct::host {

/// One level's coefficients in the precision that computes. Lines run along x, planes are made of lines along
/// the inner axis, and threads share the planes along the outer axis. Reading one plane and one
/// cell before the first is allowed (zeros).
template <class T>
struct HostLevel {
  int nx = 1;
  int ni = 1;
  int no = 1;
  std::array<int, 3> ratio{1, 1, 1};  ///< along x, inner, outer
  const T* gx = nullptr;
  const T* gi = nullptr;
  const T* go = nullptr;
  const T* sink = nullptr;     ///< c = D - sum g: absorption and boundary
  const T* inverse = nullptr;  ///< 1 / D
  const T* own = nullptr;      ///< transfer weights; null on the last level
  const T* wx = nullptr;
  const T* wi = nullptr;
  const T* wo = nullptr;
  Buffer<T> storage;

  std::size_t row(int j, int k) const {
    return (static_cast<std::size_t>(k) * ni + j) * static_cast<std::size_t>(nx);
  }
  std::size_t cell_count() const { return row(0, no); }
};

/// A medium as the host's sweeps read it.
template <class T>
struct HostGrid {
  std::vector<diffusion::Level> exact;  ///< in float64, axes x, inner, outer
  std::vector<HostLevel<T>> levels;     ///< of K / unit
  double unit =
      1.0;     ///< the largest D of the finest level, so that single precision is in its middle
  int nx = 1;  ///< of the caller's block
  int ny = 1;
  int nz = 1;
  bool exchanged = false;    ///< the inner axis is z
  diffusion::Medium medium;  ///< with the axes exchanged, where they are
  diffusion::LevelBuilder builder;

  /// The first cell of line (y, z) in the caller's fields.
  std::size_t cell(int y, int z) const {
    return (static_cast<std::size_t>(z) * ny + y) * static_cast<std::size_t>(nx);
  }
  /// The same line's inner and outer index.
  std::pair<int, int> row_of(int y, int z) const {
    return exchanged ? std::pair{z, y} : std::pair{y, z};
  }
};

/// The longer of y and z becomes the outer axis. `medium` must be valid. Whatever `grid` held, its
/// memory is used again. The team shares the work.
template <class T>
void build_host_grid(const diffusion::Medium& medium, ThreadTeam& team, HostGrid<T>& grid);

}  // namespace opaline::reconstruct::host
