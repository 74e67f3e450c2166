// Single and double precision against 128 bits: the matrix of docs/physics.md assembled and factorised in quadruple
// precision, so that what each back end says of its own accuracy is held to a solution that has none of its rounding.

#include <gmock/gmock.h>

#include <cmath>

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/host/host_solver.h"
#include "tests/reconstruct/support/media.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using diffusion::FluenceSolver;
using diffusion::Medium;
using diffusion::testing::random_medium;

__extension__ using Quad = __float128;
using QuadMatrix = std::vector<Quad>;  // dense, row after row

QuadMatrix assemble(const Medium& medium) {
  const Block& b = medium.block;
  const std::size_t n = b.cell_count();
  QuadMatrix matrix(n * n, 0);
  const auto h = b.spacing();
  const auto count = b.cells();
  const Quad volume = Quad(b.hx) * b.hy * b.hz;
  for (int k = 0; k < b.nz; ++k)
    for (int j = 0; j < b.ny; ++j)
      for (int i = 0; i < b.nx; ++i) {
        const std::size_t cell = b.index(i, j, k);
        const Quad kappa = medium.diffusion[cell];
        matrix[cell * n + cell] += volume * medium.absorption[cell];
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (const int side : {-1, 1}) {
            std::array<int, 3> at{i, j, k};
            at[axis] += side;
            const Quad area = volume / h[axis];
            if (at[axis] < 0 || at[axis] >= count[axis]) {
              matrix[cell * n + cell] +=
                  area / (2 * Quad(medium.boundary_a) + h[axis] / (2 * kappa));
              continue;
            }
            const std::size_t other = b.index(at[0], at[1], at[2]);
            const Quad beside = medium.diffusion[other];
            const Quad g = area / h[axis] * 2 * kappa * beside / (kappa + beside);
            matrix[cell * n + cell] += g;
            matrix[cell * n + other] -= g;
          }
      }
  return matrix;
}

/// By L D L^T, which for an M-matrix needs no pivots.
FieldBatch exact_solution(const Medium& medium, const FieldBatch& b) {
  const std::size_t n = b.cells;
  QuadMatrix a = assemble(medium);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = k + 1; i < n; ++i) {
      if (a[i * n + k] == 0) continue;
      const Quad factor = a[i * n + k] / a[k * n + k];
      for (std::size_t j = k + 1; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      a[i * n + k] = factor;
    }
  FieldBatch phi(b.cells, b.count);
  for (int m = 0; m < b.count; ++m) {
    std::vector<Quad> x(b.field(m), b.field(m) + n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < i; ++k) x[i] -= a[i * n + k] * x[k];
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t j = i + 1; j < n; ++j) x[i] -= a[i * n + j] * x[j];
      x[i] /= a[i * n + i];
    }
    for (std::size_t i = 0; i < n; ++i) phi.field(m)[i] = static_cast<double>(x[i]);
  }
  return phi;
}

struct Case {
  const char* name;
  Medium medium;
  double tightest = 1e-10;  // residual that half precision inside gets to
};

Medium clear(Medium medium) {
  std::fill(medium.absorption.begin(), medium.absorption.end(), 0.0);
  return medium;
}

class Exact : public ::testing::TestWithParam<Case> {
 protected:
  Exact() : b_(GetParam().medium.block.cell_count(), 2) {
    const Block& block = GetParam().medium.block;
    b_.field(0)[0] = 1.0;
    b_.field(1)[block.index(block.nx / 2, block.ny / 2, 0)] = 1.0;
    exact_ = exact_solution(GetParam().medium, b_);
  }
  double error_of(FluenceSolver& solver, double tolerance) {
    FieldBatch phi(b_.cells, b_.count);
    EXPECT_TRUE(solver.prepare(GetParam().medium));
    const auto solved = solver.solve(b_, phi, {tolerance, 1000}, {});
    EXPECT_TRUE(solved);
    EXPECT_EQ(solved->termination, diffusion::Termination::kConverged) << solved->message;
    return diffusion::testing::worst_difference(phi, exact_);
  }
  FieldBatch b_;
  FieldBatch exact_;
};

// Rounding of 1.1e-16 an operation, some hundreds of them, times how much the medium magnifies what is lost: for an
// M-matrix little, as entries keep their signs.
TEST_P(Exact, ADirectSolutionInDoubleIsAsGoodAsItsRounding) {
  testing_support::DirectSolver direct;
  EXPECT_LE(error_of(direct, 0.0), 1e-12);
}

// A relative residual, so an error of at most the condition number times it. These are 1e3 to 1e6, and what is found is
// less, since the sources are as smooth as a lit face.
TEST_P(Exact, ASolutionToAResidualIsThatGoodInEveryPrecision) {
  for (const double tolerance : {1e-6, GetParam().tightest}) {
    EXPECT_LE(error_of(*diffusion::make_reference_solver(), tolerance), 1e3 * tolerance);
    for (const auto precision : {diffusion::Precision::kHalf,
                                 diffusion::Precision::kSingle,
                                 diffusion::Precision::kDouble}) {
      const auto host = host::make_host_solver({.threads = 2, .precision = precision});
      EXPECT_LE(error_of(*host, tolerance), 1e3 * tolerance) << diffusion::to_string(precision);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Media,
    Exact,
    ::testing::Values(Case{"Contrast1e6", random_medium({6, 6, 6, 0.5, 0.5, 0.5}, 1e6, 1), 1e-8},
                      Case{"NoAbsorption",
                           clear(random_medium({6, 6, 6, 0.5, 0.5, 0.5}, 100.0, 2))},
                      Case{"FlatVoxels", random_medium({6, 6, 6, 1.0, 1.0, 0.01}, 100.0, 3)},
                      Case{"TallVoxels", random_medium({6, 6, 6, 0.01, 0.01, 1.0}, 100.0, 4)},
                      Case{"Slab", random_medium({12, 12, 1, 0.5, 0.5, 0.5}, 100.0, 5)},
                      Case{"OneVoxel", random_medium({1, 1, 1, 0.5, 0.5, 0.5}, 1.0, 6)}),
    [](const auto& which) { return std::string(which.param.name); });

}  // namespace
}  // namespace opaline::reconstruct
