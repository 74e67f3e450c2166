#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <algorithm>
#include <chrono>
#include <vector>

#include "bench/figure.h"
#include "bench/forward/forward_case.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::Medium;
using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// docs/physics.md, "Discretisation on a block sample", cell by cell.
Matrix assemble(const Medium& medium) {
  const Block& block = medium.block;
  const auto n = static_cast<Eigen::Index>(block.cell_count());
  Matrix matrix(n, n);
  matrix.reserve(Eigen::VectorXi::Constant(n, 7));
  for (std::size_t cell = 0; cell < block.cell_count(); ++cell) {
    const auto nx = static_cast<std::size_t>(block.nx);
    const auto ny = static_cast<std::size_t>(block.ny);
    const std::array<std::size_t, 3> at{cell % nx, cell / nx % ny, cell / (nx * ny)};
    const std::array<std::size_t, 3> stride{1, nx, nx * ny};
    double diagonal = block.cell_volume() * medium.absorption[cell];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double h = block.spacing()[axis];
      const double area = block.cell_volume() / h;
      const double wall = area / (2.0 * medium.boundary_a + h / (2.0 * medium.diffusion[cell]));
      const auto link = [&](std::size_t other) {
        const double sum = medium.diffusion[cell] + medium.diffusion[other];
        const double g = area / h * 2.0 * medium.diffusion[cell] * medium.diffusion[other] / sum;
        matrix.insert(static_cast<Eigen::Index>(cell), static_cast<Eigen::Index>(other)) = -g;
        diagonal += g;
      };
      if (at[axis] == 0)
        diagonal += wall;
      else
        link(cell - stride[axis]);
      if (at[axis] + 1 == static_cast<std::size_t>(block.cells()[axis]))
        diagonal += wall;
      else
        link(cell + stride[axis]);
    }
    matrix.insert(static_cast<Eigen::Index>(cell), static_cast<Eigen::Index>(cell)) = diagonal;
  }
  matrix.makeCompressed();
  return matrix;
}

}  // namespace

struct ExactMatrix::Assembled {
  Matrix matrix;
};

ExactMatrix::ExactMatrix(const Medium& medium)
    : assembled_(std::make_unique<Assembled>(Assembled{assemble(medium)})) {}
ExactMatrix::~ExactMatrix() = default;

void ExactMatrix::residual(const double* b, const double* x, double* r) const {
  const Matrix& matrix = assembled_->matrix;
  const Eigen::Index n = matrix.rows();
  Eigen::Map<Eigen::VectorXd>(r, n) =
      Eigen::Map<const Eigen::VectorXd>(b, n) - matrix * Eigen::Map<const Eigen::VectorXd>(x, n);
}

double relative_residual(const ForwardCase& problem, const FieldBatch& x) {
  const ExactMatrix matrix(problem.medium);
  const auto n = static_cast<Eigen::Index>(x.cells);
  Eigen::VectorXd r(n);
  double worst = 0.0;
  for (int m = 0; m < x.count; ++m) {
    matrix.residual(problem.b.field(m), x.field(m), r.data());
    worst =
        std::max(worst, r.norm() / Eigen::Map<const Eigen::VectorXd>(problem.b.field(m), n).norm());
  }
  return worst;
}

EigenRun run_eigen_cg(const ForwardCase& problem, double tolerance, int rounds) {
  const Matrix matrix = assemble(problem.medium);
  const auto n = static_cast<Eigen::Index>(problem.b.cells);
  FieldBatch x(problem.b.cells, problem.b.count);
  std::vector<double> seconds;
  for (int round = 0; round < rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    Eigen::ConjugateGradient<Matrix, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(tolerance);
    solver.compute(matrix);
    for (int m = 0; m < problem.b.count; ++m)
      Eigen::Map<Eigen::VectorXd>(x.field(m), n) =
          solver.solve(Eigen::Map<const Eigen::VectorXd>(problem.b.field(m), n));
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return {median(std::move(seconds)), relative_residual(problem, x)};
}

}  // namespace opaline::bench
