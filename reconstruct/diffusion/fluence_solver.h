#pragma once

#include <cstddef>
#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "base/block.h"
#include "base/result.h"

namespace opaline::reconstruct::diffusion {

/// The matrix of one channel: coefficients per cell and the boundary's constant.
///
///   sum_faces a kappa_f / h (phi_i - phi_j) + (sum_boundary a g_b + V sigma_a) phi_i = b_i
///   (docs/physics.md) kappa_f = 2 kappa_i kappa_j / (kappa_i + kappa_j),   g_b = 1 / (2 A + h / (2
///   kappa_i))
struct Medium {
  Block block;
  std::vector<double> diffusion;   ///< kappa per cell, mm, > 0
  std::vector<double> absorption;  ///< sigma_a per cell, 1/mm, >= 0
  double boundary_a = 1.0;         ///< A of the boundary model (diffusion/boundary.h)
};

/// Several fields over the cells of a block, one after another: value = values[field * cells +
/// cell].
struct FieldBatch {
  std::size_t cells = 0;
  int count = 0;
  std::vector<double> values;

  FieldBatch() = default;
  FieldBatch(std::size_t cell_count, int field_count)
      : cells(cell_count), count(field_count), values(cell_count * field_count, 0.0) {}
  void clear() { values.assign(values.size(), 0.0); }
  double* field(int m) { return values.data() + m * cells; }
  const double* field(int m) const { return values.data() + m * cells; }
};

enum class Termination : std::uint8_t { kConverged, kIterationLimit, kBreakdown, kCancelled };

struct SolveOptions {
  double tolerance = 1e-6;   ///< on ||b - K phi|| / ||b|| of every right-hand side, in float64; > 0
  int max_iterations = 100;  ///< of conjugate gradients; >= 1
};

struct SolveSummary {
  Termination termination = Termination::kIterationLimit;
  int iterations = 0;
  double relative_residual = 0.0;  ///< ||b - K phi|| / ||b||, worst right-hand side, in double
  std::string message;             ///< one line for people
};

/// Solves K phi_m = b_m for many right-hand sides of one medium at once (K is symmetric, so
/// adjoints too).
///
/// Shapes:  b and phi hold block.cell_count() cells each; b gives the number of right-hand sides.
/// Threads: one call at a time per object; separate objects are independent.
/// Errors:  kInvalidArgument when shapes differ, coefficients are out of range or not finite;
/// kCancelled;
///          kUnavailable when a device is lost. Not converging is an answer:
///          SolveSummary::termination.
class FluenceSolver {
 public:
  virtual ~FluenceSolver() = default;
  /// Takes the coefficients and builds the coarser grids.
  virtual Result<void> prepare(const Medium& medium) = 0;
  /// Starts from phi as given: zeros, or an earlier solution.
  virtual Result<SolveSummary> solve(const FieldBatch& b,
                                     FieldBatch& phi,
                                     const SolveOptions& options,
                                     std::stop_token stop) = 0;
  virtual std::string description() const = 0;  ///< "host, 2 threads, AVX2"
};

}  // namespace opaline::reconstruct::diffusion
