#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion {

/// One grid of the hierarchy: the matrix on it, and how it hands residuals down and takes
/// corrections back.
///
///   (K u)_i = D_i u_i - sum_faces g_ij u_j
///
/// Cells are stored x fastest, as in base/block.h. On level 0 g and D are exactly those of
/// docs/physics.md. On coarser levels a conductance is the sum over the fine faces between two
/// aggregates, divided by the distance of their centres in fine cells: exact where kappa is constant, and
/// where it jumps within an aggregate better than the resistances in series (at a contrast of 1e4 it
/// halves the iterations). At the surface half the aggregate's own link lies in series with the fine
/// boundary. Absorption adds up. A coarser level's conductances and
/// walls are then divided by 1.1: they are too stiff for smooth errors, so corrections fall short, and a tenth more
/// leaves a quarter to a half of the residual after eight iterations (over-correction, Braess 1995, Computing 55).
/// Absorption is not: its sum is what smooth errors meet.
///
/// A fine cell f of aggregate I takes its correction from I and from the aggregates J_a that it
/// touches, one along each coarsened axis a,
///
///   (P e)_f = (1 - sum_a w_a) e_I + sum_a w_a e_Ja,     w_a = R_I / (R_I + R_f + R_J)
///
/// with R_I, R_J the resistances from the two centres to f's own line across the face and R_f that
/// of the face: linear where kappa is constant (w = 1/4), and following the jumps of kappa where it
/// is not. Beyond the surface e = 0, at the resistance of the boundary condition. Restriction is
/// the transpose. The weights follow from flux continuity along one grid line, as in Alcouffe,
/// Brandt, Dendy & Painter (1981), SIAM J. Sci. Stat. Comput. 2, Eq. 2.10.
struct Level {
  std::array<int, 3> cells{1, 1, 1};
  std::array<std::vector<double>, 3>
      conductance;                    ///< g to the next cell along the axis; 0 in the last
  std::vector<double> diagonal;       ///< D: conductances, boundary and absorption
  std::array<int, 3> ratio{1, 1, 1};  ///< cells of an aggregate along each axis, 1 or 2
  std::array<std::vector<double>, 3> transfer;  ///< w; empty along axes of ratio 1

  std::size_t cell_count() const {
    return static_cast<std::size_t>(cells[0]) * cells[1] * cells[2];
  }
  std::size_t stride(int axis) const {
    return axis == 0   ? 1
           : axis == 1 ? static_cast<std::size_t>(cells[0])
                       : static_cast<std::size_t>(cells[0]) * cells[1];
  }
};

/// Levels from the block's own grid down to a single cell. Axes are coarsened by two while their
/// cells are less than 1.7 times as long as the shortest ones, so point smoothing is enough for
/// flat cells too.
///
/// `medium` must be valid (diffusion/medium_check.h). Who builds many of them keeps a diffusion/level_builder.h.
std::vector<Level> build_levels(const Medium& medium);

/// Red cells have an even sum of indices, on every level.
constexpr bool is_red(int i, int j, int k) { return (i + j + k) % 2 == 0; }

/// r = b - K x for one field, in float64.
void residual(const Level& level, const double* b, const double* x, double* r);

}  // namespace opaline::reconstruct::diffusion
