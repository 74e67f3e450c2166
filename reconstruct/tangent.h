#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "base/material.h"
#include "base/result.h"
#include "reconstruct/adjoint.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct {

/// The discrete forward model of one channel, linearised at a point: the Jacobian J of the whitened
/// radiances sqrt(w) L by p = (log sigma_s', log sigma_a), all sigma_s' first, as products.
///
///   apply:           K dphi = db - dK phi,   dL by radiance_change() (reconstruct/observation.h)
///   apply_adjoint:   the discrete adjoint gradient (docs/physics.md, "Gradient, in full") with
///                    sqrt(w) y in place of w (L - L*)
///
/// so J^T residual() is the gradient of the data term, and J^T J Gauss-Newton's Hessian. Each
/// product is one batched solve, of as many right-hand sides as illuminations.
///
/// Shapes:  data vectors hold the seen face's raster of each illumination, one after another; 0
///          where masked.
/// Threads: one call at a time. The problem and the solver outlive it, and between its making and
///          its last product nobody else prepares the solver.
/// Errors:  the solver's; kCancelled; kInternal when a solve stays far from its tolerance.
class Tangent {
 public:
  /// Prepares the solver and solves for the fluence at `coefficients`: one batched solve.
  /// `tolerance`: relative residual of every solve.
  static Result<Tangent> at(const ChannelProblem& problem,
                            diffusion::FluenceSolver& solver,
                            const ChannelCoefficients& coefficients,
                            double tolerance,
                            std::stop_token stop);
  /// Where the solver is prepared for `coefficients`, and `fluence` is known there already: no
  /// solve.
  Tangent(const ChannelProblem& problem,
          diffusion::FluenceSolver& solver,
          const ChannelCoefficients& coefficients,
          diffusion::FieldBatch fluence,
          double tolerance);

  std::size_t parameter_count() const { return 2 * problem_->block.cell_count(); }
  std::size_t data_count() const {
    return problem_->illuminations.size() * problem_->camera.size();
  }
  /// J v.
  Result<std::vector<double>> apply(std::span<const double> v, std::stop_token stop);
  /// J^T y.
  Result<std::vector<double>> apply_adjoint(std::span<const double> y, std::stop_token stop);
  /// sqrt(w) (L - L*).
  std::vector<double> residual() const;

  const ChannelCoefficients& coefficients() const { return coefficients_; }
  /// Solves for one right-hand side done so far.
  long solves() const { return solves_; }

 private:
  Result<diffusion::FieldBatch> solve(const diffusion::FieldBatch& b, std::stop_token stop);
  /// The derivative of the right-hand sides, less dK phi; and of what escapes, per illumination.
  diffusion::FieldBatch moved_right_sides(const diffusion::MediumChange& change,
                                          std::vector<std::vector<double>>& escape) const;

  const ChannelProblem* problem_;
  diffusion::FluenceSolver* solver_;
  ChannelCoefficients coefficients_;
  LitMedium lit_;
  diffusion::FieldBatch fluence_;
  double tolerance_;
  long solves_ = 0;
};

}  // namespace opaline::reconstruct
