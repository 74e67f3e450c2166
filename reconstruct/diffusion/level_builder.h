#pragma once

#include <array>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/multigrid.h"

namespace opaline::reconstruct::diffusion {

/// Builds the levels of diffusion/multigrid.h, again and again: it keeps what it needs besides them, so that building the
/// hierarchy of another medium on the same grid asks the system for no memory.
///
/// Every array is walked once or twice, plane by plane; the team shares the planes along the third axis, and the numbers are the
/// same however they are shared. One division a face of the finest level, one more for the weights of two cells.
///
/// Threads: one call at a time per object.
class LevelBuilder {
 public:
  /// Levels from the block's own grid down to a single cell, whatever `levels` held. `medium` must be valid
  /// (diffusion/medium_check.h).
  void build(const Medium& medium, ThreadTeam& team, std::vector<Level>& levels);

  /// What a level is made of besides its matrix: needed to build the next one.
  struct Parts {
    std::array<double, 3> spacing{};
    std::vector<double> sink;  ///< absorption, V sigma_a
    std::array<std::array<std::vector<double>, 2>, 3>
        wall;  ///< boundary conductance, [axis][min, max][face cell]
  };

 private:
  std::vector<Parts> parts_;  ///< of each level
};

}  // namespace opaline::reconstruct::diffusion
