#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "base/flush_denormals.h"
#include "base/thread_team.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/host/field_kernels.h"
#include "reconstruct/host/host_grid.h"
#include "reconstruct/host/row_kernels.h"
#include "reconstruct/host/workspace.h"

namespace opaline::reconstruct::host {

/// Up to 16 fields of the caller's batches, solved together.
struct Group {
  const diffusion::FieldBatch& b;
  diffusion::FieldBatch& x;
  int first = 0;
  int count = 1;
  std::span<const double> b_norms;  ///< ||b||^2 of the group's fields
  bool x_is_zero = false;           ///< where that is known; it saves the first product
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
/// The iteration reads and writes the finest level three times and stores no q = K p: the last
/// half-sweep also sums delta = z . K z, from which
///
///   p . K p = delta - beta^2 p_before . K p_before          (Chronopoulos & Gear 1989, J. Comput.
///                                                            Appl. Math. 25, section 3)
///
/// so alpha is known before p is, and one sweep makes p, K p and the new r. Where a red cell has
/// just been relaxed K z = r there, which is half of delta.
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
  Parents parents(int level, int j, int k) const;
  Weights<T> weights(const Wave& w, int j, int k) const;

  void scale_row(const Wave& w, int j, int k);
  void sweep_row(const Wave& w, int j, int k, int colour);
  void restrict_wave(const Wave& w);
  void restrict_row(const Wave& w, int j, int k);
  void clear_below(const Wave& w, int k);
  void store_below(const Wave& w, int k);
  void prolong_wave(const Wave& w);
  void prolong_row(const Wave& w, int j, int k);
  void emit_row(const Wave& w, int j, int k);
  void energy_row(const Wave& w, int j, int k);
  void combine_halo(Slab slab);
  void update_slab(Slab slab, Direction mode);
  void move_rows(Rows rows, int k, Direction mode);
  void update_rows(Rows rows, int k, const Planes& u);
  void rescale();
  std::span<const double> residual_pass(bool keeps);
  void residual_slab(Slab slab, bool moves);
  void residual_ends(Slab slab);
  void add_correction(Rows rows, int z, int thread);
  void residual_rows(Rows rows, int z, int thread);
  int rows_at_once(int thread) const;
  FieldLine field_line(int m, int y, int z) const;
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
  bool correction_ = false;  ///< d holds something
  bool step_ = false;        ///< d lacks step_length p
  bool restart_ = false;
  bool keeps_ = true;          ///< the residual pass stores r
  bool sets_ = false;          ///< it sets x, which was zero
  std::array<T, 16> alpha_{};  ///< rho / gamma
  std::array<T, 16> step_length_{};
  std::array<T, 16> beta_{};
  std::array<T, 16> factor_{};  ///< by which r is rescaled
  std::vector<double> scale_;   ///< 1 / ||b||
  std::vector<double> growth_;  ///< the power of two
  std::vector<double> rho_, rho_before_, swept_, gamma_, norms_;
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
