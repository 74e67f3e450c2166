#pragma once

#include <Eigen/Sparse>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::testing_support {

/// The matrix of docs/physics.md, "Discretisation on a block sample", assembled entry by entry.
Eigen::SparseMatrix<double> assemble(const reconstruct::diffusion::Medium& medium);

/// Solves by sparse Cholesky factorisation (Eigen), to rounding: what iterative solvers answer to,
/// for small blocks.
class DirectSolver : public reconstruct::diffusion::FluenceSolver {
 public:
  Result<void> prepare(const reconstruct::diffusion::Medium& medium) override;
  Result<reconstruct::diffusion::SolveSummary> solve(
      const reconstruct::diffusion::FieldBatch& b,
      reconstruct::diffusion::FieldBatch& phi,
      const reconstruct::diffusion::SolveOptions& options,
      std::stop_token stop) override;
  std::string description() const override { return "direct (Eigen)"; }

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace opaline::testing_support
