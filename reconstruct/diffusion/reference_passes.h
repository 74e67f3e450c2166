#pragma once

#include <span>
#include <vector>

#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/multigrid.h"

namespace opaline::reconstruct::diffusion {

/// The passes of diffusion/passes.h as plain loops in double precision: what the fast back ends
/// answer to. The levels, b and phi must outlive the object; phi is x, updated by true_residual().
class ReferencePasses {
 public:
  ReferencePasses(const std::vector<Level>& levels, const FieldBatch& b, FieldBatch& phi);

  int levels() const { return static_cast<int>(levels_.size()); }
  std::span<const double> true_residual();
  std::span<const double> true_norm() { return true_residual(); }
  double finishing() const { return 1.0; }
  double trusted_fall() const { return 1e-5; }
  void smooth_restrict(int level);
  void prolong_smooth(int level);
  void apply_dot(bool restart);
  std::span<const double> update_norm();

  /// For comparing other back ends pass by pass.
  FieldBatch& r(int level) { return r_[level]; }
  FieldBatch& z(int level) { return z_[level]; }
  std::span<const double> rho() const { return rho_; }

 private:
  void sweep(int level, int field, bool red);
  double neighbours(const Level& level, const double* u, int i, int j, int k) const;

  const std::vector<Level>& levels_;
  const FieldBatch& b_;
  FieldBatch& x_;
  std::vector<FieldBatch> r_;  ///< one a level
  std::vector<FieldBatch> z_;
  FieldBatch p_, q_, d_;
  std::vector<double> rho_, rho_before_, gamma_, norms_;
};

}  // namespace opaline::reconstruct::diffusion
