#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "base/flush_denormals.h"
#include "base/thread_team.h"
#include "reconstruct/diffusion/fluence_solver.h"
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

/// The passes of diffusion/passes.h for the processor. Each is one wave over the planes: while a
/// plane is in the cache, every half-sweep of the pass goes over it, each one plane behind the one
/// before. Threads own slabs of planes and compute the few planes beyond the slab that they need
/// for themselves, so no thread reads what another one writes and the numbers are the same however
/// the planes are shared.
///
/// Right-hand sides are scaled to ||b|| = 1 and the matrix by HostGrid::unit. All arguments must outlive the object.
class HostPasses {
 public:
  HostPasses(ThreadTeam& team, const HostGrid& grid, Workspace& work, const Group& group);

  int levels() const { return static_cast<int>(grid_.levels.size()); }
  std::span<const double> true_residual();
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
  /// Planes before, at and after, null outside the grid.
  struct Planes {
    const float* before;
    const float* at;
    const float* after;
  };

  template <class F>
  void for_slabs(int parts, int planes, const F& f);
  /// The rows of the next level that a line belongs to: its own and those beside, which may not exist.
  struct Parents {
    int j;
    int j_side;
    int k;
    int k_side;
    bool has_inner;
    bool has_outer;
  };

  Stencil stencil(int level, const Planes& u, int j, int k) const;
  const float* row_or_zeros(const float* plane, const HostField& field, int j) const;

  Parents parents(int level, int j, int k) const;
  Weights weights(int level, int j, int k) const;

  void scale_row(int level, float* z, int j, int k);
  void sweep_row(int level, float* z, const Planes& u, int j, int k, int colour);
  void restrict_slab(int level, Slab coarse);
  void restrict_row(int level, const Planes& u, int j, int k, Slab coarse);
  void prolong_slab(int level, Slab slab);
  void prolong_row(int level, float* z, int j, int k);
  void combine_halo(Slab slab);
  void apply_slab(Slab slab, Direction mode);
  void add_correction(Slab slab);
  void residual_slab(Slab slab);
  void add_to_line(
      const float* d, double d_factor, const float* p, double p_factor, double* x) const;
  double copy_line(int m, int j, int k, std::vector<double>& line) const;
  double residual_line(int m, int j, int k, std::vector<double>& line) const;
  double* sums(int plane);
  void clear_sums(int plane);
  void total(std::vector<double>& sums) const;

  ThreadTeam& team_;
  const HostGrid& grid_;
  Workspace& work_;
  Group group_;
  RowKernels kernels_;
  int width_;
  bool correction_ = false;  ///< d holds something
  bool step_ = false;        ///< d lacks alpha p
  std::array<float, 16> alpha_{};
  std::array<float, 16> beta_{};
  std::vector<double> scale_;  ///< 1 / ||b||
  std::vector<double> rho_, rho_before_, gamma_, norms_;
};

template <class F>
void HostPasses::for_slabs(int parts, int planes, const F& f) {
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
