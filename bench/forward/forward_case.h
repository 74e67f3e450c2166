#pragma once

#include <string>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::bench {

/// A forward problem as a reconstruction poses it: a heterogeneous block lit from behind in 4 x 4 patches.
struct ForwardCase {
  std::string name;
  reconstruct::diffusion::Medium medium;
  reconstruct::diffusion::FieldBatch b;  ///< 16 right-hand sides
};

/// Cells of 0.5 mm; kappa from 0.1 to 1 mm and sigma_a from 0.001 to 0.1 per mm, both smooth and random (the sum of 24
/// plane waves of 8 mm and longer, mapped to the whole range in logarithms); Robin on all six sides, A at eta = 1.3.
ForwardCase make_forward_case(const std::string& name, int nx, int ny, int nz);

/// ||b - K x|| / ||b|| of the worst right-hand side in float64, with the matrix written down here, apart from the solvers.
double relative_residual(const ForwardCase& problem, const reconstruct::diffusion::FieldBatch& x);

/// Median seconds that Eigen's conjugate gradients with diagonal preconditioner take for all right-hand sides to the
/// tolerance, factorisation included, over the given rounds; and the residual they reach.
struct EigenRun {
  double seconds = 0.0;
  double relative_residual = 0.0;
};
EigenRun run_eigen_cg(const ForwardCase& problem, double tolerance, int rounds);

}  // namespace opaline::bench
