#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

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
/// One of the cases that are measured: a64 (64 x 64 x 32), wax1 (130 x 53 x 37), marble (256 x 256 x 20), cube64 and
/// cube256 (64 and 256 cells a side); nothing for another name.
std::optional<ForwardCase> make_forward_case(const std::string& name);

/// K in float64, written down here apart from the solvers.
class ExactMatrix {
 public:
  explicit ExactMatrix(const reconstruct::diffusion::Medium& medium);
  ~ExactMatrix();
  ExactMatrix(const ExactMatrix&) = delete;
  ExactMatrix& operator=(const ExactMatrix&) = delete;
  /// r = b - K x, one value a cell each.
  void residual(const double* b, const double* x, double* r) const;

 private:
  struct Assembled;
  std::unique_ptr<Assembled> assembled_;
};

/// ||b - K x|| / ||b|| of the worst right-hand side in float64.
double relative_residual(const ForwardCase& problem, const reconstruct::diffusion::FieldBatch& x);

/// Median seconds that Eigen's conjugate gradients with diagonal preconditioner take for all right-hand sides to the
/// tolerance, factorisation included, over the given rounds; and the residual they reach.
struct EigenRun {
  double seconds = 0.0;
  double relative_residual = 0.0;
};
EigenRun run_eigen_cg(const ForwardCase& problem, double tolerance, int rounds);

/// Relative L2 of the fluence in the cells behind the face z_max, the worst right-hand side's: what a camera sees.
double front_face_error(const ForwardCase& problem,
                        const reconstruct::diffusion::FieldBatch& x,
                        const reconstruct::diffusion::FieldBatch& exact);

/// Hierarchical relaxation as Wang 2008, section 5.3, has it: Jacobi sweeps from the coarsest grid to the finest, each
/// level starting from the one before. Single precision, every core, the instruction set of the processor. Sweeps of the
/// finest level go on until the front-face error is `error`, looked at every 20 sweeps with the clock stopped. In single
/// precision alone they come to rest at some 1e-5; so at every twentieth look, the clock still stopped, what is left is
/// put on the right-hand side in float64 and swept further, which changes nothing else about the iterates.
struct RelaxationRun {
  double seconds = 0.0;
  int sweeps = 0;      ///< of the finest level
  double error = 0.0;  ///< reached
};
/// All illuminations in one sweep, side by side in registers: better than published.
RelaxationRun run_relaxation(const ForwardCase& problem,
                             const reconstruct::diffusion::FieldBatch& exact,
                             double error);
/// As published: one illumination after the other, vectorised along lines of cells. The first `count` are run; seconds
/// are theirs times all / count.
RelaxationRun run_published_relaxation(const ForwardCase& problem,
                                       const reconstruct::diffusion::FieldBatch& exact,
                                       double error,
                                       int count);

}  // namespace opaline::bench
