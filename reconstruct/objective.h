#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/material.h"
#include "base/result.h"
#include "reconstruct/adjoint.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/evaluation.h"
#include "reconstruct/regularizer.h"
#include "reconstruct/tangent.h"

namespace opaline::reconstruct {

/// The inverse problem of one channel (docs/physics.md, "Inverse problem"):
///
///   J(p) = 1/2 sum_m sum_x w_m(x) (L_m(x; p) - L*_m(x))^2 + R(log kappa) + R(log sigma_a)
///
/// over p = (log sigma_s', log sigma_a) per cell, all sigma_s' first. L is the radiance towards the
/// camera of the diffused light; the gradient is the discrete adjoint's, exact to the tolerance of
/// the solves.
///
/// All illuminations go through one FluenceSolver::solve call; fluence and adjoint start from the
/// last ones. Threads: one call at a time per object; the problem and the solver must outlive it.
/// Errors:  the solver's; kInternal when a solve stays far from its tolerance.
class Objective {
 public:
  struct Settings {
    double tolerance = 1e-6;      ///< of the diffusion solves
    double regularization = 0.0;  ///< lambda of the Regularizer
    Smoothness regularizer = Smoothness::kH1;
  };
  Objective(const ChannelProblem& problem, diffusion::FluenceSolver& solver, Settings settings);

  std::size_t parameter_count() const { return 2 * problem_.block.cell_count(); }
  Result<Evaluation> evaluate(std::span<const double> p, std::stop_token stop);
  /// J alone: half the solves.
  Result<double> value(std::span<const double> p, std::stop_token stop);

  /// Radiance per illumination on the seen face's cells; no adjoint solve.
  Result<std::vector<std::vector<double>>> predict(const ChannelCoefficients& coefficients,
                                                   std::stop_token stop);

  /// The forward model's linearisation at p; no solve where p is what evaluate() was called with last.
  Result<Tangent> tangent(std::span<const double> p, std::stop_token stop);
  /// Gauss-Newton's second derivative of J at the tangent's point, times v: J^T J v and the regulariser's
  /// (Regularizer::add_product on the logarithms' own moves). Two solves an illumination.
  Result<std::vector<double>> hessian_product(Tangent& tangent,
                                              std::span<const double> v,
                                              const std::stop_token& stop);

  /// Forgets the fields that solves start from, so that what follows depends on p alone.
  void start_afresh();
  /// Solves for one right-hand side done so far.
  long solves() const { return solves_; }

 private:
  Result<void> solve_forward(const ChannelCoefficients& coefficients, std::stop_token stop);
  Result<void> solve_adjoint(std::stop_token stop);
  Result<void> solve(const diffusion::FieldBatch& b,
                     diffusion::FieldBatch& x,
                     std::stop_token stop);
  void observe();
  double residuals();
  void add_gradient(const ChannelCoefficients& coefficients, Evaluation& out) const;
  void regularize(const ChannelCoefficients& coefficients,
                  Evaluation& out,
                  diffusion::MediumGradient& logs) const;
  void add_regularizer_product(const ChannelCoefficients& c,
                               std::span<const double> v,
                               std::span<double> product) const;

  const ChannelProblem& problem_;
  diffusion::FluenceSolver& solver_;
  Settings settings_;
  Regularizer regularizer_;
  long solves_ = 0;

  std::optional<LitMedium> lit_;  // the last one solved for
  diffusion::FieldBatch fluence_;
  diffusion::FieldBatch adjoint_;
  diffusion::FieldBatch right_sides_;  // kept: fresh memory for it took a sixth of an evaluation
  std::vector<std::vector<double>> radiance_;  // per illumination
  RadianceResiduals radiance_residual_;
};

/// (log sigma_s', log sigma_a), all sigma_s' first, and back.
std::vector<double> to_parameters(const ChannelCoefficients& coefficients);
ChannelCoefficients to_coefficients(std::span<const double> p);

}  // namespace opaline::reconstruct
