#include "tests/support/direct_solver.h"

#include <array>
#include <vector>

namespace opaline::testing_support {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::Medium;
using reconstruct::diffusion::SolveOptions;
using reconstruct::diffusion::SolveSummary;
using reconstruct::diffusion::Termination;

Eigen::SparseMatrix<double> assemble(const Medium& medium) {
  const Block& block = medium.block;
  const auto h = block.spacing();
  const auto n = block.cells();
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&entries](std::size_t i, std::size_t j, double v) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(j), v);
  };
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const std::size_t cell = block.index(i, j, k);
        const double kappa = medium.diffusion[cell];
        add(cell, cell, block.cell_volume() * medium.absorption[cell]);
        for (const Face face : kFaces) {
          const auto axis = static_cast<std::size_t>(axis_of(face));
          std::array<int, 3> at{i, j, k};
          at[axis] += is_max(face) ? 1 : -1;
          const double area = block.face_cell_area(face);
          if (at[axis] < 0 || at[axis] >= n[axis]) {
            add(cell, cell, area / (2.0 * medium.boundary_a + h[axis] / (2.0 * kappa)));
            continue;
          }
          const std::size_t other = block.index(at[0], at[1], at[2]);
          const double other_kappa = medium.diffusion[other];
          const double g = area / h[axis] * 2.0 * kappa * other_kappa / (kappa + other_kappa);
          add(cell, cell, g);
          add(cell, other, -g);
        }
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(block.cell_count());
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Result<void> DirectSolver::prepare(const Medium& medium) {
  factor_.compute(assemble(medium));
  if (factor_.info() != Eigen::Success) return internal_error("factorisation failed");
  return ok();
}

Result<SolveSummary> DirectSolver::solve(const FieldBatch& b,
                                         FieldBatch& phi,
                                         const SolveOptions& /*options*/,
                                         std::stop_token stop) {
  if (stop.stop_requested()) return cancelled("direct solve cancelled");
  for (int m = 0; m < b.count; ++m) {
    const auto size = static_cast<Eigen::Index>(b.cells);
    Eigen::Map<Eigen::VectorXd>(phi.field(m), size) =
        factor_.solve(Eigen::Map<const Eigen::VectorXd>(b.field(m), size));
  }
  return SolveSummary{Termination::kConverged, 1, 1e-15, "direct"};
}

}  // namespace opaline::testing_support
