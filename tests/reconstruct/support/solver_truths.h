#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Sparse>
#include <memory>
#include <vector>

#include "reconstruct/diffusion/fluence_solver.h"
#include "tests/reconstruct/support/media.h"

/// What every FluenceSolver must get right, whichever back end it runs on: a typed suite over
/// factories.
///   INSTANTIATE_TYPED_TEST_SUITE_P(Host, SolverTruths, HostFactory);   struct { static
///   std::unique_ptr<FluenceSolver> make(); }
namespace opaline::reconstruct::diffusion::testing {

/// The matrix of docs/physics.md written down face by face, sharing no line with the solvers.
inline Eigen::SparseMatrix<double> assemble(const Medium& medium) {
  const Block& block = medium.block;
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](std::size_t row, std::size_t column, double value) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  };
  const auto face = [&](std::size_t i, std::size_t j, double area, double h) {
    const double ki = medium.diffusion[i];
    const double kj = medium.diffusion[j];
    const double g = area * (2.0 * ki * kj / (ki + kj)) / h;
    add(i, i, g);
    add(j, j, g);
    add(i, j, -g);
    add(j, i, -g);
  };
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const std::size_t c = block.index(i, j, k);
        if (i + 1 < block.nx) face(c, block.index(i + 1, j, k), block.hy * block.hz, block.hx);
        if (j + 1 < block.ny) face(c, block.index(i, j + 1, k), block.hx * block.hz, block.hy);
        if (k + 1 < block.nz) face(c, block.index(i, j, k + 1), block.hx * block.hy, block.hz);
        add(c, c, block.hx * block.hy * block.hz * medium.absorption[c]);
      }
  for (const Face side : kFaces)
    for (int row = 0; row < block.face_height(side); ++row)
      for (int column = 0; column < block.face_width(side); ++column) {
        const std::size_t c = block.cell_behind(side, column, row);
        const double h = block.spacing()[axis_of(side)];
        const double gb = 1.0 / (2.0 * medium.boundary_a + h / (2.0 * medium.diffusion[c]));
        add(c, c, block.face_cell_area(side) * gb);
      }
  const auto n = static_cast<int>(block.cell_count());
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// K^-1 b by a direct factorisation.
inline FieldBatch solve_directly(const Medium& medium, const FieldBatch& b) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(assemble(medium));
  FieldBatch phi(b.cells, b.count);
  const auto n = static_cast<Eigen::Index>(b.cells);
  const Eigen::Map<const Eigen::MatrixXd> right(b.values.data(), n, b.count);
  Eigen::Map<Eigen::MatrixXd>(phi.values.data(), n, b.count) = factors.solve(right);
  return phi;
}

/// ||b - K phi|| / ||b||, the worst field's, with the matrix written down here.
inline double residual_of(const Medium& medium, const FieldBatch& b, const FieldBatch& phi) {
  const Eigen::SparseMatrix<double> matrix = assemble(medium);
  const auto n = static_cast<Eigen::Index>(b.cells);
  const Eigen::Map<const Eigen::MatrixXd> right(b.values.data(), n, b.count);
  const Eigen::Map<const Eigen::MatrixXd> x(phi.values.data(), n, b.count);
  const Eigen::MatrixXd left = right - matrix * x;
  return (left.colwise().norm().array() / right.colwise().norm().array()).maxCoeff();
}

template <class Factory>
class SolverTruths : public ::testing::Test {
 protected:
  FieldBatch solve(const Medium& medium, const FieldBatch& b, double tolerance) {
    const std::unique_ptr<FluenceSolver> solver = Factory::make();
    EXPECT_TRUE(solver->prepare(medium));
    FieldBatch phi(b.cells, b.count);
    const Result<SolveSummary> solved = solver->solve(b, phi, {tolerance, 100}, {});
    EXPECT_TRUE(solved) << solved.error().message;
    if (solved) {
      EXPECT_EQ(solved->termination, Termination::kConverged) << solved->message;
      EXPECT_LE(solved->relative_residual, tolerance);
      EXPECT_NEAR(solved->relative_residual, residual_of(medium, b, phi), 0.01 * tolerance + 1e-13);
      iterations_ = solved->iterations;
    }
    return phi;
  }
  int iterations_ = 0;
};
TYPED_TEST_SUITE_P(SolverTruths);

// Tolerance: the residual of 1e-12 times a condition number of about 1e3 on these blocks.
TYPED_TEST_P(SolverTruths, AgreesWithADirectFactorisationOnHeterogeneousBlocks) {
  const std::vector<Block> blocks{{1, 1, 1, 0.5, 0.4, 0.3},
                                  {2, 1, 1, 1, 1, 1},
                                  {6, 5, 4, 0.5, 0.5, 0.5},
                                  {7, 3, 9, 0.5, 1.3, 0.2},
                                  {1, 12, 5, 0.4, 0.4, 0.4},
                                  {13, 1, 1, 0.1, 2, 2}};
  for (const Block& block : blocks)
    for (const int count : {1, 3, 8, 17}) {
      const Medium medium = random_medium(block, 100.0, 7);
      const FieldBatch b = random_fields(block, count, 11);
      const FieldBatch phi = this->solve(medium, b, 1e-12);
      EXPECT_LT(worst_difference(phi, solve_directly(medium, b)), 1e-9)
          << block.nx << "x" << block.ny << "x" << block.nz << ", " << count << " fields";
    }
}

// A column of cells without lateral faces would be one-dimensional; ours has Robin faces, so the
// column is made so wide that they carry nothing: hx = hy = 1e9 mm. Exact: kappa phi'' = sigma_a
// phi, phi -/+ 2 A kappa phi' = S or 0 at the ends.
TYPED_TEST_P(SolverTruths, ConvergesToTheSlabsClosedFormAtSecondOrder) {
  const double kappa = 0.4;
  const double absorption = 0.05;
  const double a = 2.34053;
  const double thickness = 8.0;
  const double s = std::sqrt(absorption / kappa);
  const double l = 2.0 * a * kappa *
                   s;  // phi = c1 cosh(s z) + c2 sinh(s z): c1 - l c2 = 1 and the far end's zero
  const double ch = std::cosh(s * thickness);
  const double sh = std::sinh(s * thickness);
  const double c2 = -(ch + l * sh) / (l * (ch + l * sh) + (sh + l * ch));
  const double c1 = 1.0 + l * c2;
  std::vector<double> errors;
  for (const int n : {8, 16, 32, 64}) {
    const double h = thickness / n;
    const Block block{1, 1, n, 1e9, 1e9, h};
    const Medium medium{
        block, std::vector<double>(n, kappa), std::vector<double>(n, absorption), a};
    FieldBatch b(block.cell_count(), 1);
    b.values[0] = 1e18 / (2.0 * a + h / (2.0 * kappa));
    const FieldBatch phi = this->solve(medium, b, 1e-10);
    double sum = 0.0;
    for (int k = 0; k < n; ++k) {
      const double z = (k + 0.5) * h;
      sum += std::pow(phi.values[k] - c1 * std::cosh(s * z) - c2 * std::sinh(s * z), 2) / n;
    }
    errors.push_back(std::sqrt(sum));
  }
  for (std::size_t n = 1; n < errors.size(); ++n)
    EXPECT_NEAR(errors[n - 1] / errors[n], 4.0, 0.4) << n;
}

TYPED_TEST_P(SolverTruths, IsItsOwnAdjoint) {
  const Block block{17, 33, 5, 0.5, 0.5, 0.5};
  const Medium medium = random_medium(block, 100.0, 3);
  const FieldBatch b = random_fields(block, 2, 5);
  const FieldBatch phi = this->solve(medium, b, 1e-12);
  double forward = 0.0;
  double backward = 0.0;
  for (std::size_t c = 0; c < b.cells; ++c) {
    forward += b.field(0)[c] * phi.field(1)[c];
    backward += b.field(1)[c] * phi.field(0)[c];
  }
  EXPECT_NEAR(forward / backward, 1.0, 1e-10);
}

// Sum over boundary of a gb (phi - S) must carry off what entered. The balance is the sum of the
// residual over the cells, so it follows from the tolerance: at most sqrt(cells) ||r||.
TYPED_TEST_P(SolverTruths, LosesNoEnergyWithoutAbsorption) {
  const Block block{24, 24, 12, 0.5, 0.5, 0.5};
  Medium medium = random_medium(block, 30.0, 9);
  std::fill(medium.absorption.begin(), medium.absorption.end(), 0.0);
  FieldBatch b(block.cell_count(), 1);
  for (int j = 8; j < 14; ++j)
    for (int i = 8; i < 14; ++i) b.values[block.index(i, j, 0)] = 1.0;
  const FieldBatch phi = this->solve(medium, b, 1e-9);
  double leaving = 0.0;
  for (const Face side : kFaces)
    for (int row = 0; row < block.face_height(side); ++row)
      for (int column = 0; column < block.face_width(side); ++column) {
        const std::size_t c = block.cell_behind(side, column, row);
        const double gb = 1.0 / (2.0 * medium.boundary_a + 0.5 / (2.0 * medium.diffusion[c]));
        leaving += block.face_cell_area(side) * gb * phi.values[c];
      }
  EXPECT_NEAR(leaving / 36.0, 1.0, 1e-7);
}

TYPED_TEST_P(SolverTruths, ObeysTheMaximumPrinciple) {
  const Block block{20, 20, 20, 0.5, 0.5, 0.5};
  const Medium medium = random_medium(block, 1000.0, 21);
  FieldBatch b(block.cell_count(), 1);
  b.values[block.index(0, 0, 0)] = 1.0;
  const FieldBatch phi = this->solve(medium, b, 1e-10);
  const auto [low, high] = std::minmax_element(phi.values.begin(), phi.values.end());
  EXPECT_GE(*low, -1e-9 * *high);
  EXPECT_EQ(high - phi.values.begin(), 0);
}

// The bounds leave a quarter to what was seen; independently drawn cells of contrast 1e4 are far
// from any material.
TYPED_TEST_P(SolverTruths, NeedsFewIterationsWhateverTheContrast) {
  struct Row {
    double contrast;
    int iterations;
  };
  for (const Row row : {Row{1.0, 11}, Row{10.0, 11}, Row{100.0, 14}, Row{1e4, 50}}) {
    const Block block{32, 32, 32, 0.5, 0.5, 0.5};
    const Medium medium = random_medium(block, row.contrast, 1);
    this->solve(medium, random_fields(block, 1, 2), 1e-6);
    EXPECT_LE(this->iterations_, row.iterations) << row.contrast;
  }
  for (const Block& block : {Block{32, 32, 16, 0.5, 0.5, 2.0},
                             Block{32, 32, 16, 0.5, 0.5, 0.05},
                             Block{24, 24, 24, 0.05, 0.5, 5.0}}) {
    this->solve(random_medium(block, 10.0, 1), random_fields(block, 1, 2), 1e-6);
    EXPECT_LE(this->iterations_, 11) << block.hz;
  }
}

TYPED_TEST_P(SolverTruths, StartsFromTheFluenceItIsGiven) {
  const Block block{9, 8, 7, 0.5, 0.5, 0.5};
  const Medium medium = random_medium(block, 10.0, 1);
  const FieldBatch b = random_fields(block, 2, 2);
  const std::unique_ptr<FluenceSolver> solver = TypeParam::make();
  ASSERT_TRUE(solver->prepare(medium));
  FieldBatch phi = solve_directly(medium, b);
  const Result<SolveSummary> solved = solver->solve(b, phi, {}, {});
  ASSERT_TRUE(solved);
  EXPECT_EQ(solved->iterations, 0);
}

TYPED_TEST_P(SolverTruths, AnswersADarkRightHandSideWithDarkness) {
  const Block block{5, 4, 3, 0.5, 0.5, 0.5};
  FieldBatch b = random_fields(block, 2, 2);
  std::fill(b.field(1), b.field(1) + b.cells, 0.0);
  const FieldBatch phi = [&] {
    const std::unique_ptr<FluenceSolver> solver = TypeParam::make();
    EXPECT_TRUE(solver->prepare(random_medium(block, 10.0, 1)));
    FieldBatch start(b.cells, b.count);
    std::fill(start.values.begin(), start.values.end(), 1.0);
    EXPECT_TRUE(solver->solve(b, start, {}, {}));
    return start;
  }();
  EXPECT_EQ(*std::max_element(phi.field(1), phi.field(1) + phi.cells), 0.0);
  EXPECT_GT(phi.field(0)[0], 0.0);
}

TYPED_TEST_P(SolverTruths, NamesTheCellThatIsWrong) {
  const Block block{5, 4, 3, 0.5, 0.5, 0.5};
  const std::unique_ptr<FluenceSolver> solver = TypeParam::make();
  Medium medium = random_medium(block, 10.0, 1);
  FieldBatch phi(block.cell_count(), 1);
  FieldBatch b(block.cell_count(), 1);
  EXPECT_EQ(solver->solve(b, phi, {}, {}).error().code,
            ErrorCode::kInvalidArgument);  // not prepared
  medium.diffusion[block.index(2, 3, 1)] = 0.0;
  EXPECT_THAT(solver->prepare(medium).error().message, ::testing::HasSubstr("cell (2, 3, 1)"));
  medium = random_medium(block, 10.0, 1);
  medium.absorption[block.index(4, 0, 2)] = std::nan("");
  EXPECT_THAT(solver->prepare(medium).error().message, ::testing::HasSubstr("cell (4, 0, 2)"));
  medium = random_medium(block, 10.0, 1);
  ASSERT_TRUE(solver->prepare(medium));
  b.values[block.index(1, 1, 1)] = std::nan("");
  EXPECT_THAT(solver->solve(b, phi, {}, {}).error().message,
              ::testing::HasSubstr("cell (1, 1, 1)"));
  FieldBatch small(7, 1);
  EXPECT_EQ(solver->solve(small, phi, {}, {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(solver->solve(phi, phi, {0.0, 10}, {}).error().code, ErrorCode::kInvalidArgument);
}

TYPED_TEST_P(SolverTruths, StopsWhenAskedAndSaysWhenItsIterationsRunOut) {
  const Block block{16, 16, 16, 0.5, 0.5, 0.5};
  const std::unique_ptr<FluenceSolver> solver = TypeParam::make();
  ASSERT_TRUE(solver->prepare(random_medium(block, 10.0, 1)));
  const FieldBatch b = random_fields(block, 1, 2);
  FieldBatch phi(b.cells, 1);
  const Result<SolveSummary> limited = solver->solve(b, phi, {1e-8, 2}, {});
  ASSERT_TRUE(limited);
  EXPECT_EQ(limited->termination, Termination::kIterationLimit);
  EXPECT_GT(limited->relative_residual, 1e-8);
  std::stop_source stop;
  stop.request_stop();
  std::fill(phi.values.begin(), phi.values.end(), 0.0);
  EXPECT_EQ(solver->solve(b, phi, {}, stop.get_token()).error().code, ErrorCode::kCancelled);
}

REGISTER_TYPED_TEST_SUITE_P(SolverTruths,
                            AgreesWithADirectFactorisationOnHeterogeneousBlocks,
                            ConvergesToTheSlabsClosedFormAtSecondOrder,
                            IsItsOwnAdjoint,
                            LosesNoEnergyWithoutAbsorption,
                            ObeysTheMaximumPrinciple,
                            NeedsFewIterationsWhateverTheContrast,
                            StartsFromTheFluenceItIsGiven,
                            AnswersADarkRightHandSideWithDarkness,
                            NamesTheCellThatIsWrong,
                            StopsWhenAskedAndSaysWhenItsIterationsRunOut);

}  // namespace opaline::reconstruct::diffusion::testing
