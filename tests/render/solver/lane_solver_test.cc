#include "render/solver/lane_solver.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/render/solver/lane_grid.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Termination;

Eigen::MatrixXd dense(const LaneMatrix<double>& a, int channel) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(a.rows(), a.rows());
  for (int i = 0; i < a.rows(); ++i) {
    matrix(i, i) = a.diagonal(i)[channel];
    for (int e = a.starts[i]; e < a.starts[i + 1]; ++e)
      matrix(i, a.columns[e]) = a.entries[e][channel];
  }
  return matrix;
}

TEST(LaneSolver, AgreesWithADirectSolverInEveryChannel) {
  ThreadTeam team(2);
  const auto a = grid<double>(9, 50.0);
  LaneSolver<double> solver(a, {.coarsest_rows = 20}, team);
  ASSERT_GT(solver.hierarchy().levels(), 2);
  const auto b = random_field<double>(a.rows(), 1);
  auto x = dark<double>(a.rows());
  const auto summary = solver.solve(b, x, {.tolerance = 1e-10}, {});
  ASSERT_EQ(summary.termination, Termination::kConverged) << summary.message;
  for (int c = 0; c < 3; ++c) {
    Eigen::VectorXd right(a.rows());
    for (int i = 0; i < a.rows(); ++i) right[i] = b[i][c];
    const Eigen::VectorXd exact = dense(a, c).ldlt().solve(right);
    for (int i = 0; i < a.rows(); ++i) EXPECT_NEAR(x[i][c], exact[i], 1e-7 * exact.maxCoeff());
  }
}

TEST(LaneSolver, IterationsHardlyGrowWithTheNumberOfNodes) {
  ThreadTeam team(2);
  int small = 0;
  for (const int n : {16, 32, 48, 82}) {
    const auto a = grid<float>(n, 1.0, 1e-2);
    LaneSolver<float> solver(a, {}, team);
    auto x = dark<float>(a.rows());
    const auto summary = solver.solve(random_field<float>(a.rows(), 2), x, {.tolerance = 1e-4}, {});
    ASSERT_EQ(summary.termination, Termination::kConverged) << summary.message;
    if (small == 0) small = summary.iterations;
    EXPECT_LE(summary.iterations, small + 4) << n;
    EXPECT_LE(solver.hierarchy().complexity(), 2.0);
  }
}

TEST(LaneSolver, EveryLevelOfTheHierarchySparesIterationsAndNoneIsNeededForTheSolution) {
  ThreadTeam team(2);
  const auto a = grid<double>(32, 1.0, 1e-3);
  const auto b = random_field<double>(a.rows(), 2);
  std::vector<int> iterations;
  std::vector<double> first;
  for (const int levels : {1, 2, 20}) {
    LaneSolver<double> solver(a, {.most_levels = levels}, team);
    EXPECT_LE(solver.hierarchy().levels(), levels);
    auto x = dark<double>(a.rows());
    const auto summary = solver.solve(b, x, {.tolerance = 1e-9, .max_iterations = 2000}, {});
    ASSERT_EQ(summary.termination, Termination::kConverged) << summary.message;
    iterations.push_back(summary.iterations);
    first.push_back(x[0][0]);
  }
  EXPECT_GT(iterations[0], iterations[1]);
  EXPECT_GE(iterations[1], iterations[2]);
  EXPECT_GT(iterations[0], 3 * iterations[2]);
  EXPECT_NEAR(first[0], first[2], 1e-5 * std::abs(first[2]));
}

TEST(LaneSolver, ContrastsOfAMillionConverge) {
  ThreadTeam team(2);
  for (const double contrast : {1e-6, 1e6}) {
    const auto a = grid<double>(24, contrast);
    LaneSolver<double> solver(a, {}, team);
    auto x = dark<double>(a.rows());
    const auto summary = solver.solve(
        random_field<double>(a.rows(), 3), x, {.tolerance = 1e-6, .max_iterations = 60}, {});
    EXPECT_EQ(summary.termination, Termination::kConverged) << contrast << ": " << summary.message;
  }
}

TEST(LaneSolver, WhatSinglePrecisionCannotReachIsSaid) {
  ThreadTeam team(2);
  const auto a = grid<float>(24, 1e6);
  LaneSolver<float> solver(a, {}, team);
  auto x = dark<float>(a.rows());
  const auto summary = solver.solve(
      random_field<float>(a.rows(), 3), x, {.tolerance = 1e-12, .max_iterations = 200}, {});
  EXPECT_NE(summary.termination, Termination::kConverged);
  EXPECT_GT(summary.relative_residual, 1e-12);
}

TEST(LaneSolver, OneCycleIsASymmetricOperator) {
  ThreadTeam team(2);
  const auto a = grid<double>(17, 10.0);
  const SweepMatrix<double> finest(a, team.size(), false);
  ASSERT_EQ(finest.blocks(), 2);
  Hierarchy<double> hierarchy(a, {}, team.size());
  const auto u = random_field<double>(a.rows(), 4);
  const auto v = random_field<double>(a.rows(), 5);
  auto bu = dark<double>(a.rows());
  auto bv = dark<double>(a.rows());
  const Lanes<double> own = hierarchy.precondition(finest, u, bu, team);
  hierarchy.precondition(finest, v, bv, team);
  for (int c = 0; c < 3; ++c) {
    double ubv = 0.0;
    double vbu = 0.0;
    double ubu = 0.0;
    for (int i = 0; i < a.rows(); ++i) {
      ubv += u[i][c] * bv[i][c];
      vbu += v[i][c] * bu[i][c];
      ubu += u[i][c] * bu[i][c];
    }
    EXPECT_NEAR(own[c] / ubu, 1.0, 1e-12);
    EXPECT_NEAR(ubv / vbu, 1.0, 1e-10);
  }
}

TEST(LaneSolver, ALightThatIsACombinationOfThoseBeforeNeedsNoIteration) {
  ThreadTeam team(2);
  const auto a = grid<float>(20, 1.0, 0.1);
  LaneSolver<float> solver(a, {}, team, 3);
  const auto first = random_field<float>(a.rows(), 6);
  const auto second = random_field<float>(a.rows(), 7);
  auto x = dark<float>(a.rows());
  EXPECT_GT(solver.solve(first, x, {.tolerance = 1e-5}, {}).iterations, 2);
  EXPECT_GT(solver.solve(second, x, {.tolerance = 1e-5}, {}).iterations, 2);
  auto mixed = first;
  for (std::size_t i = 0; i < mixed.size(); ++i) mixed[i] = first[i] * 0.7f + second[i] * 0.5f;
  const auto summary = solver.solve(mixed, x, {.tolerance = 1e-4}, {});
  EXPECT_EQ(summary.iterations, 0) << summary.message;
  solver.forget();
  auto cold = dark<float>(a.rows());
  EXPECT_GT(solver.solve(mixed, cold, {.tolerance = 1e-4}, {}).iterations, 2);
}

/// Iterations of ten solves, a tenth more absorption in one place after each: a brush held still.
int iterations_of_edits(int remembered) {
  ThreadTeam team(2);
  auto a = grid<double>(24, 1.0, 0.1);
  LaneSolver<double> solver(a, {}, team, remembered);
  const auto b = random_field<double>(a.rows(), 10);
  auto x = dark<double>(a.rows());
  solver.solve(b, x, {.tolerance = 1e-6}, {});
  int iterations = 0;
  for (int edit = 0; edit < 10; ++edit) {
    for (int n = 0; n < 500; ++n) a.sinks[n + 1000] *= 1.1;
    solver.matrix_changed();
    const auto summary = solver.solve(b, x, {.tolerance = 1e-6}, {});
    EXPECT_EQ(summary.termination, Termination::kConverged);
    iterations += summary.iterations;
  }
  return iterations;
}

TEST(LaneSolver, WhatAnEditChangesStartsFromWhatTheEditsBeforeChanged) {
  EXPECT_LT(iterations_of_edits(4), 0.8 * iterations_of_edits(0));
}

TEST(LaneSolver, AChannelWithoutLightIsDarkWhateverItWasBefore) {
  ThreadTeam team(1);
  const auto a = grid<float>(12);
  LaneSolver<float> solver(a, {}, team);
  auto b = random_field<float>(a.rows(), 8);
  for (auto& value : b) value.set(1, 0.0f);
  auto x = random_field<float>(a.rows(), 9);
  ASSERT_EQ(solver.solve(b, x, {.tolerance = 1e-4}, {}).termination, Termination::kConverged);
  for (const auto& value : x) EXPECT_EQ(value[1], 0.0f);
  EXPECT_GT(x[0][0], 0.0f);
}

TEST(LaneSolver, EndsWithTheReasonWhereItCannotGoOn) {
  ThreadTeam team(1);
  const auto a = grid<float>(12);
  LaneSolver<float> solver(a, {}, team);
  auto b = random_field<float>(a.rows(), 10);
  auto x = dark<float>(a.rows());
  EXPECT_EQ(solver.solve(b, x, {.tolerance = 1e-6, .max_iterations = 1}, {}).termination,
            Termination::kIterationLimit);
  std::stop_source stop;
  stop.request_stop();
  x = dark<float>(a.rows());
  EXPECT_EQ(solver.solve(b, x, {}, stop.get_token()).termination, Termination::kCancelled);
  b[7].set(0, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(solver.solve(b, x, {}, {}).termination, Termination::kBreakdown);
}

}  // namespace
}  // namespace opaline::render
