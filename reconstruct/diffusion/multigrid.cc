#include "reconstruct/diffusion/multigrid.h"

#include "reconstruct/diffusion/level_builder.h"

namespace opaline::reconstruct::diffusion {

std::vector<Level> build_levels(const Medium& medium) {
  ThreadTeam alone(1);
  std::vector<Level> levels;
  LevelBuilder().build(medium, alone, levels);
  return levels;
}

void residual(const Level& level, const double* b, const double* x, double* r) {
  const std::size_t count = level.cell_count();
  for (std::size_t c = 0; c < count; ++c) r[c] = b[c] - level.diagonal[c] * x[c];
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = level.stride(axis);
    const double* g = level.conductance[axis].data();  // 0 behind the last cell of a line
    for (std::size_t c = 0; c + stride < count; ++c) r[c] += g[c] * x[c + stride];
    for (std::size_t c = stride; c < count; ++c) r[c] += g[c - stride] * x[c - stride];
  }
}

}  // namespace opaline::reconstruct::diffusion
