#include "reconstruct/host/workspace.h"

#include <algorithm>

namespace opaline::reconstruct::host {
namespace {

constexpr std::size_t kNumbersPerThread = 16384;  // about 10 us of sweeping: worth waking somebody

std::vector<std::array<int, 3>> sizes_of(const HostGrid& grid) {
  std::vector<std::array<int, 3>> sizes;
  for (const HostLevel& level : grid.levels) sizes.push_back({level.nx, level.ni, level.no});
  return sizes;
}

}  // namespace

HostField::HostField(const HostLevel& level, int planes, int width)
    : row_((static_cast<std::size_t>(level.nx) + 1) * width),
      plane_(row_ * level.ni),
      storage_(plane_ * planes + 2 * kGuard) {}

Workspace::Workspace(const HostGrid& grid, int lanes, int threads)
    : width(lanes), sizes_(sizes_of(grid)) {
  for (const HostLevel& level : grid.levels) {
    const std::size_t worth = level.cell_count() * lanes / kNumbersPerThread;
    parts_.push_back(static_cast<int>(std::clamp<std::size_t>(worth, 1, threads)));
    r.emplace_back(level, level.no, lanes);
    z.emplace_back(level, level.no, lanes);
    auto& planes = scratch.emplace_back();
    for (int thread = 0; thread < parts_.back(); ++thread) planes.emplace_back(level, 4, lanes);
  }
  const HostLevel& finest = grid.levels.front();
  for (HostField* field : {&p, &q, &d}) *field = HostField(finest, finest.no, lanes);
  const std::size_t row = (static_cast<std::size_t>(finest.nx) + 2) * lanes;
  discard.assign(threads, std::vector<float>(row, 0.0F));
  zeros.assign(row, 0.0F);
  plane_sums.assign(static_cast<std::size_t>(finest.no) * lanes, 0.0);
}

bool Workspace::fits(const HostGrid& grid) const { return sizes_ == sizes_of(grid); }

}  // namespace opaline::reconstruct::host
