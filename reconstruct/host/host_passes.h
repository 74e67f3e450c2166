#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "base/flush_denormals.h"
#include "base/thread_team.h"
#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/host/field_kernels.h"
#include "reconstruct/host/host_grid.h"
#include "reconstruct/host/row_kernels.h"
#include "reconstruct/host/workspace.h"

namespace opaline::reconstruct::host {

constexpr int kRed = 0;
constexpr int kBlack = 1;

/// The first cell of a colour on line (j, k), from an even cell on.
constexpr int first_of(int colour, int j, int k) { return (j + k + colour) % 2; }

/// Up to 16 fields of the caller's batches, solved together.
struct Group {
  const diffusion::FieldBatch& b;
  diffusion::FieldBatch& x;
  int first = 0;
  int count = 1;
  std::span<const double> b_norms;  ///< ||b||^2 of the group's fields
  bool x_is_zero = false;           ///< where that is known; it need not be read
};

/// The passes of diffusion/passes.h for the processor. T computes, S is how corrections lie in
/// memory.
///
/// A pass of the V-cycle is one wave over the planes of a tile: while a plane is in the cache, every
/// half-sweep goes over it, each one plane behind the one before, in a ring of planes of the
/// thread's own. Tiles and slabs compute the few cells around them that they need for themselves, so
/// no thread reads what another one writes, and the numbers are the same however the planes are
/// shared.
///
/// Conjugate gradients run on the black cells alone. x is relaxed in the red ones in float64 before its
/// residual is taken, so r vanishes there and stays so under
///
///   S = K_bb - K_br K_rr^-1 K_rb      (Saad 2003, Iterative Methods for Sparse Linear Systems, 12.4.2)
///
/// whose conjugate gradients move half of the bytes, and whose V-cycle is that of K on r = 0 in red
/// cells: z there is not kept. In single precision t = K_rr^-1 K_rb p comes with what its rounding
/// left, or S p would lose as many digits as K is ill-conditioned.
///
/// The iteration reads and writes the finest level three times and stores no q = S p. After the last
/// half-sweep the red cells take z_r = (sum g z_b) / D for
///
///   delta = z . S z = sum c z^2 + sum over faces g (z_r - z_b)^2,
///
/// which cannot cancel, and which rounding of z_r changes in second order only, for there it is least; then
///
///   p . S p = delta - beta^2 p_before . S p_before          (Chronopoulos & Gear 1989, J. Comput.
///                                                            Appl. Math. 25, section 3)
///
/// so alpha is known before p is, and one sweep makes the step s = alpha p, S s and the new r.
///
/// d + s is rounded to what d can hold, and s is what d then moved by: r hears of that rounding as of any step, and
/// stays the residual of x + d but for the rounding of S s. When ||r|| has fallen by a thousand, d is put aside and
/// another one begun, small enough to hold the steps to come. So single precision falls by 1e-6 without a look at
/// float64 in between; what r then lacks was 7e-8 of ||b|| on the benchmark's media.
///
/// Before x is looked at for the last time the black cells take z = r / D, which conjugate gradients would have gone on
/// with: the residual then falls 1.5 times (at a contrast of 1e5) to 3.5 times.
///
/// Right-hand sides are scaled to ||b|| = 1 and then by a power of two that keeps ||r|| near 1, the
/// matrix by HostGrid::unit. All arguments must outlive the object.
template <class T, class S>
class HostPasses {
 public:
  HostPasses(ThreadTeam& team, const HostGrid<T>& grid, Workspace<T, S>& work, const Group& group);

  int levels() const { return static_cast<int>(grid_.levels.size()); }
  std::span<const double> true_residual() { return residual_pass(true); }
  std::span<const double> true_norm() { return residual_pass(false); }
  double finishing() const { return 2.0; }
  double trusted_fall() const { return sizeof(T) == sizeof(double) ? 1e-12 : 1e-6; }
  void smooth_restrict(int level);
  void prolong_smooth(int level);
  void apply_dot(bool restart);
  std::span<const double> update_norm();

 private:
  struct Slab {
    int thread;
    int begin;
    int end;
    bool has(int plane) const { return begin <= plane && plane < end; }
  };
  /// Of a plane.
  struct Rows {
    int begin;
    int end;
    int count() const { return end - begin; }
  };
  /// Planes before, at and after, null outside the grid, and the cells that their rows begin at.
  struct Planes {
    const T* before;
    const T* at;
    const T* after;
    std::size_t row_size;
    int rows;
    int low_x;
    int low_inner;
  };
  /// The rows of the next level that a line belongs to: its own and those beside, which may not exist.
  struct Parents {
    int j;
    int j_side;
    int k;
    int k_side;
    bool has_inner;
    bool has_outer;
  };
  /// One wave over a tile of a level's slab.
  struct Wave {
    int l;
    const HostLevel<T>& level;
    const Tile& tile;
    std::size_t tile_index;
    Scratch<T>& scratch;
    Slab slab;
  };

  template <class F>
  void for_slabs(int parts, int planes, const F& f);
  template <class F>
  void for_waves(int l, Slab slab, const F& f);

  Planes around(const Wave& w, int k) const;
  T* ring_row(const Wave& w, int j, int k) const;
  Stencil<T> stencil(const HostLevel<T>& level, const Planes& u, int j, int k, int x) const;
  PackedStencil<T> packed_stencil(const Planes& u, int cell, int j, int k, int first) const;
  Parents parents(int level, int j, int k) const;
  Weights<T> weights(const Wave& w, int j, int k) const;

  const T* right_row(const Wave& w, int j, int k, int colour) const;
  void scale_row(const Wave& w, int j, int k, int colour);
  void sweep_row(const Wave& w, int j, int k, int colour);
  void restrict_wave(const Wave& w);
  void restrict_row(const Wave& w, int j, int k);
  void clear_below(const Wave& w, int k);
  void store_below(const Wave& w, int k);
  void prolong_wave(const Wave& w);
  void prolong_row(const Wave& w, int j, int k);
  void copy_row(const Wave& w, int j, int k);
  void emit_row(const Wave& w, int j, int k);
  void energy_row(const Wave& w, int j, int k);
  void step_row(int j, int k, T* s, T* d);
  void step_halo(Slab slab);
  void update_slab(Slab slab);
  void relax_rows(Rows rows, int k, const Planes& s, int thread);
  void update_rows(Rows rows, int k, const Planes& t);
  int black_cells(int j, int k) const;
  void rescale();
  void set_aside();
  std::span<const double> residual_pass(bool keeps);
  void dark_slab(Slab slab);
  void residual_slab(Slab slab);
  bool relaxes_late(Slab slab, int z) const;
  bool answers_late(Slab slab, int z) const;
  void relax_ends(Slab slab);
  void residual_ends(Slab slab);
  void finish_rows(Rows rows, int z);
  void add_correction(Rows rows, int z, int thread);
  void relax_lines(Rows rows, int z);
  void residual_rows(Rows rows, int z, int thread);
  int rows_at_once(int thread) const;
  FieldLines field_lines(int first, int y, int z) const;
  std::size_t line_at(int y, int z) const;
  LineCoefficients line_coefficients(int y, int z) const;
  InverseLines<T> inverse_lines(int y, int z) const;
  std::size_t sums_at(int plane, std::size_t tile) const;
  void clear_sums(int plane, std::size_t tile);
  void total(const std::vector<double>& parts, std::vector<double>& sums) const;

  ThreadTeam& team_;
  const HostGrid<T>& grid_;
  Workspace<T, S>& work_;
  Group group_;
  RowKernels<T, S> kernels_;
  FieldKernels<T> fields_;
  int width_;
  bool moved_ = false;    ///< d holds something
  bool aside_ = false;    ///< so does what was put aside
  double started_ = 1.0;  ///< the worst ||r|| / ||b|| when it was last taken in float64
  bool restart_ = false;
  bool dark_ = false;               ///< and is that of x = 0
  bool finishes_ = false;           ///< the residual pass adds r / D to d first
  bool keeps_ = true;               ///< the residual pass stores r
  std::array<double, 16> alpha_{};  ///< rho / gamma
  std::array<T, 16> along_z_{}, along_before_{}, grown_{}, shrunk_{};  ///< of StepFactors
  std::array<T, 16> factor_{};                                         ///< by which r is rescaled
  std::vector<double> scale_;                                          ///< 1 / ||b||
  std::vector<double> growth_;                                         ///< the power of two
  std::vector<double> rho_, rho_before_, energy_, gamma_, norms_;
};

template <class T, class S>
template <class F>
void HostPasses<T, S>::for_slabs(int parts, int planes, const F& f) {
  parts = std::min(parts, planes);
  const auto work = [&](int thread) {
    if (thread >= parts) return;
    const FlushDenormals flush;
    f(Slab{thread, planes * thread / parts, planes * (thread + 1) / parts});
  };
  if (parts == 1) {
    work(0);
  } else {
    team_.run(work);
  }
}

}  // namespace opaline::reconstruct::host
