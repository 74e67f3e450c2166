#pragma once

#include <array>
#include <span>
#include <vector>

#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/host/host_grid.h"
#include "reconstruct/host/row_kernels.h"
#include "reconstruct/host/thread_team.h"
#include "reconstruct/host/workspace.h"

namespace opaline::reconstruct::host {

/// Up to 16 fields of the caller's batches, solved together.
struct Group {
  const diffusion::FieldBatch& b;
  diffusion::FieldBatch& x;
  int first = 0;
  int count = 1;
  std::span<const double> b_norms;  ///< ||b||^2 of the group's fields
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
  template <class F>
  void for_rows(int level, const F& f) const;
  Stencil stencil(int level, const Planes& u, int j, int k) const;
  const float* row_or_zeros(const float* plane, const HostField& field, int j) const;

  void scale_plane(int level, float* z, int k);
  void sweep_plane(int level, float* z, const Planes& u, int k, int colour);
  void restrict_slab(int level, Slab coarse);
  void restrict_plane(int level, const Planes& u, int k, Slab coarse);
  void prolong_slab(int level, Slab slab);
  void prolong_plane(int level, float* z, int k);
  void dot_plane(const float* z, int k);
  void combine_halo(Slab slab);
  void apply_slab(Slab slab, Direction mode);
  void add_correction(Slab slab);
  void residual_slab(Slab slab);
  void residual_row(int j, int k, double* line, double* sums);
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

}  // namespace opaline::reconstruct::host
