// The same forward problems by hypre's PFMG-preconditioned conjugate gradients (Falgout & Jones 2000), one process a
// core, the block cut along its longest axis. Run by forward_solve, under mpirun:
//
//   hypre_pfmg CASE ROUNDS TOLERANCE
//
// prints {"seconds": median of the rounds, "iterations": ..., "relative_residual": in float64, the worst right-hand
// side's}. Seconds count what a user of hypre pays for 16 solves: matrix, set-up of the multigrid, solves; symmetric
// red-black Gauss-Seidel, levels skipped, which was found the fastest of its settings.

#include <HYPRE_struct_ls.h>
#include <fmt/format.h>
#include <mpi.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "bench/forward/forward_case.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::Medium;
using Corner = std::array<HYPRE_Int, 3>;

/// The part of the block that this process holds, ends included.
struct Part {
  Corner low;
  Corner high;
  std::size_t cells() const {
    std::size_t n = 1;
    for (int axis = 0; axis < 3; ++axis) n *= static_cast<std::size_t>(high[axis] - low[axis] + 1);
    return n;
  }
};

Part part_of(const Block& block, int rank, int count) {
  const auto cells = block.cells();
  const auto longest = std::max_element(cells.begin(), cells.end()) - cells.begin();
  Part part{{0, 0, 0}, {cells[0] - 1, cells[1] - 1, cells[2] - 1}};
  part.low[longest] = cells[longest] * rank / count;
  part.high[longest] = cells[longest] * (rank + 1) / count - 1;
  return part;
}

template <class F>
void for_cells(const Part& part, const F& f) {
  for (HYPRE_Int k = part.low[2]; k <= part.high[2]; ++k)
    for (HYPRE_Int j = part.low[1]; j <= part.high[1]; ++j)
      for (HYPRE_Int i = part.low[0]; i <= part.high[0]; ++i) f(i, j, k);
}

/// Diagonal and the three faces towards the higher index, cell by cell (docs/physics.md).
std::vector<double> stencil_values(const Medium& medium, const Part& part) {
  const Block& block = medium.block;
  std::vector<double> values;
  values.reserve(4 * part.cells());
  for_cells(part, [&](int i, int j, int k) {
    const std::size_t cell = block.index(i, j, k);
    const std::array<int, 3> at{i, j, k};
    const std::array<std::size_t, 3> stride{
        1, static_cast<std::size_t>(block.nx), static_cast<std::size_t>(block.nx) * block.ny};
    double diagonal = block.cell_volume() * medium.absorption[cell];
    std::array<double, 3> after{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double h = block.spacing()[axis];
      const double area = block.cell_volume() / h;
      const double own = medium.diffusion[cell];
      const double wall = area / (2.0 * medium.boundary_a + h / (2.0 * own));
      const auto link = [&](std::size_t other) {
        return area / h * 2.0 * own * medium.diffusion[other] / (own + medium.diffusion[other]);
      };
      const bool last = at[axis] + 1 == block.cells()[axis];
      diagonal += at[axis] == 0 ? wall : link(cell - stride[axis]);
      diagonal += last ? wall : link(cell + stride[axis]);
      after[axis] = last ? 0.0 : -link(cell + stride[axis]);
    }
    values.insert(values.end(), {diagonal, after[0], after[1], after[2]});
  });
  return values;
}

class Hypre {
 public:
  Hypre(const ForwardCase& problem, double tolerance) : problem_(problem), tolerance_(tolerance) {
    int rank = 0;
    int count = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    part_ = part_of(problem.medium.block, rank, count);
    values_ = stencil_values(problem.medium, part_);
    for (int m = 0; m < problem.b.count; ++m) {
      b_.emplace_back();
      for_cells(part_, [&](int i, int j, int k) {
        b_.back().push_back(problem.b.field(m)[problem.medium.block.index(i, j, k)]);
      });
    }
  }

  /// Seconds of one run from the matrix's values to the last solution.
  double run() {
    MPI_Barrier(MPI_COMM_WORLD);
    const double start = MPI_Wtime();
    assemble();
    set_up();
    solutions_.clear();
    iterations_ = 0;
    for (const std::vector<double>& b : b_) solve(b);
    MPI_Barrier(MPI_COMM_WORLD);
    const double seconds = MPI_Wtime() - start;
    tear_down();
    return seconds;
  }

  int iterations() const { return iterations_; }

  /// Whole on every process.
  FieldBatch solution() const {
    const Block& block = problem_.medium.block;
    FieldBatch x(problem_.b.cells, problem_.b.count);
    for (int m = 0; m < x.count; ++m) {
      std::size_t at = 0;
      for_cells(part_, [&](int i, int j, int k) {
        x.field(m)[block.index(i, j, k)] = solutions_[static_cast<std::size_t>(m)][at++];
      });
    }
    MPI_Allreduce(MPI_IN_PLACE,
                  x.values.data(),
                  static_cast<int>(x.values.size()),
                  MPI_DOUBLE,
                  MPI_SUM,
                  MPI_COMM_WORLD);
    return x;
  }

 private:
  void assemble() {
    HYPRE_StructGridCreate(MPI_COMM_WORLD, 3, &grid_);
    HYPRE_StructGridSetExtents(grid_, part_.low.data(), part_.high.data());
    HYPRE_StructGridAssemble(grid_);
    HYPRE_StructStencilCreate(3, 4, &stencil_);
    std::array<Corner, 4> offsets{Corner{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (HYPRE_Int n = 0; n < 4; ++n)
      HYPRE_StructStencilSetElement(stencil_, n, offsets[static_cast<std::size_t>(n)].data());
    HYPRE_StructMatrixCreate(MPI_COMM_WORLD, grid_, stencil_, &matrix_);
    HYPRE_StructMatrixSetSymmetric(matrix_, 1);
    HYPRE_StructMatrixInitialize(matrix_);
    std::array<HYPRE_Int, 4> entries{0, 1, 2, 3};
    HYPRE_StructMatrixSetBoxValues(
        matrix_, part_.low.data(), part_.high.data(), 4, entries.data(), values_.data());
    HYPRE_StructMatrixAssemble(matrix_);
    for (HYPRE_StructVector* vector : {&right_, &left_}) {
      HYPRE_StructVectorCreate(MPI_COMM_WORLD, grid_, vector);
      HYPRE_StructVectorInitialize(*vector);
      HYPRE_StructVectorSetConstantValues(*vector, 0.0);
      HYPRE_StructVectorAssemble(*vector);
    }
  }

  void set_up() {
    HYPRE_StructPFMGCreate(MPI_COMM_WORLD, &multigrid_);
    HYPRE_StructPFMGSetMaxIter(multigrid_, 1);
    HYPRE_StructPFMGSetTol(multigrid_, 0.0);
    HYPRE_StructPFMGSetZeroGuess(multigrid_);
    HYPRE_StructPFMGSetRelaxType(multigrid_, 2);  // symmetric red-black Gauss-Seidel
    HYPRE_StructPFMGSetNumPreRelax(multigrid_, 1);
    HYPRE_StructPFMGSetNumPostRelax(multigrid_, 1);
    HYPRE_StructPFMGSetSkipRelax(multigrid_, 1);
    HYPRE_StructPCGCreate(MPI_COMM_WORLD, &solver_);
    HYPRE_StructPCGSetMaxIter(solver_, 200);
    HYPRE_StructPCGSetTol(solver_, tolerance_);
    HYPRE_StructPCGSetTwoNorm(solver_, 1);
    HYPRE_StructPCGSetPrecond(solver_, HYPRE_StructPFMGSolve, HYPRE_StructPFMGSetup, multigrid_);
    HYPRE_StructPCGSetup(solver_, matrix_, right_, left_);
  }

  void solve(const std::vector<double>& b) {
    auto* values = const_cast<double*>(b.data());
    HYPRE_StructVectorSetBoxValues(right_, part_.low.data(), part_.high.data(), values);
    HYPRE_StructVectorSetConstantValues(left_, 0.0);
    HYPRE_StructPCGSolve(solver_, matrix_, right_, left_);
    HYPRE_Int iterations = 0;
    HYPRE_StructPCGGetNumIterations(solver_, &iterations);
    iterations_ = std::max(iterations_, static_cast<int>(iterations));
    std::vector<double>& x = solutions_.emplace_back(part_.cells());
    HYPRE_StructVectorGetBoxValues(left_, part_.low.data(), part_.high.data(), x.data());
  }

  void tear_down() {
    HYPRE_StructPCGDestroy(solver_);
    HYPRE_StructPFMGDestroy(multigrid_);
    HYPRE_StructVectorDestroy(right_);
    HYPRE_StructVectorDestroy(left_);
    HYPRE_StructMatrixDestroy(matrix_);
    HYPRE_StructStencilDestroy(stencil_);
    HYPRE_StructGridDestroy(grid_);
  }

  const ForwardCase& problem_;
  double tolerance_;
  Part part_{};
  std::vector<double> values_;
  std::vector<std::vector<double>> b_;
  std::vector<std::vector<double>> solutions_;
  int iterations_ = 0;
  HYPRE_StructGrid grid_ = nullptr;
  HYPRE_StructStencil stencil_ = nullptr;
  HYPRE_StructMatrix matrix_ = nullptr;
  HYPRE_StructVector right_ = nullptr;
  HYPRE_StructVector left_ = nullptr;
  HYPRE_StructSolver multigrid_ = nullptr;
  HYPRE_StructSolver solver_ = nullptr;
};

int run(const std::string& name, int rounds, double tolerance) {
  const auto problem = make_forward_case(name);
  if (!problem || rounds < 1) return 2;
  Hypre hypre(*problem, tolerance);
  hypre.run();  // the first one asks the system for memory
  std::vector<double> seconds;
  seconds.reserve(static_cast<std::size_t>(rounds));
  for (int round = 0; round < rounds; ++round) seconds.push_back(hypre.run());
  const FieldBatch x = hypre.solution();
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0)
    fmt::print(R"({{"seconds": {:.6g}, "iterations": {}, "relative_residual": {:.3g}}})"
               "\n",
               median(seconds),
               hypre.iterations(),
               relative_residual(*problem, x));
  return 0;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr,
               "usage: hypre_pfmg CASE ROUNDS TOLERANCE (scripts/bench forward_solve runs it)\n");
    return 2;
  }
  MPI_Init(&argc, &argv);
  const int status = opaline::bench::run(argv[1], std::atoi(argv[2]), std::atof(argv[3]));
  MPI_Finalize();
  return status;
}
