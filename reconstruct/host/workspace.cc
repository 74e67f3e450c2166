#include "reconstruct/host/workspace.h"

#include <algorithm>

#include "reconstruct/host/field_kernels.h"
#include "reconstruct/host/row_kernels.h"

namespace opaline::reconstruct::host {
namespace {

constexpr std::size_t kNumbersPerThread = 16384;  // about 10 us of sweeping: worth waking somebody
// Of a tile; five such planes are at work. Narrower tiles compute more around themselves than they save.
constexpr std::size_t kPlaneBytes = 384 << 10;
constexpr std::size_t kBytesAtWork = 512 << 10;  // four planes of s, three of red cells
constexpr int kFewestRows = 8;
constexpr std::size_t kFieldNumbers = 64 << 10;  // of a thread, in the cache
constexpr int kHalo = 4;                         // cells, even: one more than half-sweeps reach
constexpr int kNarrowest = 64;

template <class T>
std::vector<std::array<int, 3>> sizes_of(const HostGrid<T>& grid) {
  std::vector<std::array<int, 3>> sizes;
  for (const HostLevel<T>& level : grid.levels) sizes.push_back({level.nx, level.ni, level.no});
  return sizes;
}

std::vector<Range> cut(int cells, int parts) {
  std::vector<Range> ranges;
  for (int part = 0; part < parts; ++part) {
    const int begin = cells * part / parts / 2 * 2;
    const int end = part + 1 == parts ? cells : cells * (part + 1) / parts / 2 * 2;
    ranges.push_back({begin, end, std::max(0, begin - kHalo), std::min(cells, end + kHalo)});
  }
  return ranges;
}

/// Cuts the longer side of a plane until a tile is small enough or narrow.
std::vector<Tile> tiles_of(int nx, int ni, std::size_t bytes_per_cell) {
  int nx_parts = 1;
  int ni_parts = 1;
  const auto bytes = [&] { return bytes_per_cell * (nx / nx_parts) * (ni / ni_parts); };
  while (bytes() > kPlaneBytes) {
    const bool along_x = nx / nx_parts >= ni / ni_parts;
    int& parts = along_x ? nx_parts : ni_parts;
    if ((along_x ? nx : ni) / (parts + 1) < kNarrowest) break;
    ++parts;
  }
  std::vector<Tile> tiles;
  for (const Range& inner : cut(ni, ni_parts))
    for (const Range& x : cut(nx, nx_parts)) tiles.push_back({x, inner});
  return tiles;
}

template <class T>
Scratch<T> make_scratch(const std::vector<Tile>& tiles, int width) {
  int nx = 0;
  int ni = 0;
  for (const Tile& tile : tiles) {
    nx = std::max(nx, tile.x.size());
    ni = std::max(ni, tile.inner.size());
  }
  const std::size_t row = (static_cast<std::size_t>(nx) + 3) * width;
  return {{nx, ni, kRing, width}, {nx + 1, ni + 1, kRing, width}, std::vector<T>(row, T{0})};
}

}  // namespace

template <class T, class S>
Workspace<T, S>::Workspace(const HostGrid<T>& grid, int lanes, int threads)
    : width(lanes), sizes_(sizes_of(grid)) {
  for (const HostLevel<T>& level : grid.levels) {
    const std::size_t worth = level.cell_count() * lanes / kNumbersPerThread;
    parts_.push_back(static_cast<int>(std::clamp<std::size_t>(worth, 1, threads)));
    const int nx = r.empty() ? half_line(level.nx) : level.nx;
    r.emplace_back(nx, level.ni, level.no, lanes);
    z.emplace_back(nx, level.ni, level.no, lanes);
    tiles.push_back(tiles_of(level.nx, level.ni, sizeof(T) * lanes));
    auto& each = scratch.emplace_back();
    for (int thread = 0; thread < parts_.back(); ++thread)
      each.push_back(make_scratch<T>(tiles.back(), lanes));
  }
  const HostLevel<T>& finest = grid.levels.front();
  const int half = half_line(finest.nx);
  for (HostField<T>* field : {&s, &d, &aside})
    *field = HostField<T>(half, finest.ni, finest.no, lanes);
  const std::size_t at_work = 10 * s.row_size() * sizeof(T);
  rows_at_work_ = std::max(kFewestRows, static_cast<int>(kBytesAtWork / at_work) / 2 * 2);
  for (int thread = 0; thread < parts_.front(); ++thread) {
    halo.emplace_back(half, finest.ni, 4, lanes);
    relaxed.emplace_back(
        half, std::min(finest.ni, rows_at_work_ + kRelaxedAnew), kRelaxedPlanes, 2 * lanes);
  }
  const std::size_t line = padded(half) * lanes;
  fields.assign(parts_.front(),
                std::vector<T>(2 * line * std::max<std::size_t>(3, kFieldNumbers / line), T{0}));
  const std::size_t row = (static_cast<std::size_t>(finest.nx) + 5) * lanes;
  zeros.assign(row, T{0});
  stored_zeros.assign(row, S{});
  const std::size_t sums =
      static_cast<std::size_t>(std::max(finest.ni, finest.no)) * tiles.front().size() * lanes;
  for (auto* each : {&rho_sums, &energy_sums, &norm_sums}) each->assign(sums, 0.0);
}

template <class T, class S>
bool Workspace<T, S>::fits(const HostGrid<T>& grid) const {
  return sizes_ == sizes_of(grid);
}

template struct Workspace<float, float>;
template struct Workspace<float, Half>;
template struct Workspace<double, double>;

}  // namespace opaline::reconstruct::host
