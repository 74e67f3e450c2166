#include "reconstruct/host/host_solver.h"

#include <array>
#include <chrono>
#include <thread>

#include "reconstruct/diffusion/reference_solver.h"
#include "tests/reconstruct/support/solver_truths.h"

namespace opaline::reconstruct::host {
namespace {

using diffusion::FieldBatch;
using diffusion::FluenceSolver;
using diffusion::Medium;
using diffusion::Precision;
using diffusion::SolveSummary;
using diffusion::testing::random_fields;
using diffusion::testing::random_medium;
using diffusion::testing::worst_difference;

template <Precision precision>
struct TwoThreads {
  static std::unique_ptr<FluenceSolver> make() {
    return make_host_solver({.threads = 2, .precision = precision});
  }
};
using TwoThreadsInHalf = TwoThreads<Precision::kHalf>;
using TwoThreadsInSingle = TwoThreads<Precision::kSingle>;
using TwoThreadsInDouble = TwoThreads<Precision::kDouble>;
constexpr std::array kPrecisions{Precision::kHalf, Precision::kSingle, Precision::kDouble};

FieldBatch solve(FluenceSolver& solver,
                 const Medium& medium,
                 const FieldBatch& b,
                 double tolerance) {
  EXPECT_TRUE(solver.prepare(medium));
  FieldBatch phi(b.cells, b.count);
  const Result<SolveSummary> solved = solver.solve(b, phi, {tolerance, 100}, {});
  EXPECT_TRUE(solved);
  EXPECT_EQ(solved->termination, diffusion::Termination::kConverged) << solved->message;
  return phi;
}

// Both end at a residual of 1e-10: they may differ by that times the condition number, about 1e3 here.
TEST(HostSolver, AgreesWithTheReferenceOnManyShapesAndCounts) {
  const auto reference = diffusion::make_reference_solver();
  const std::vector<std::pair<Block, int>> cases{{{1, 1, 1, 0.5, 0.5, 0.5}, 1},
                                                 {{17, 33, 5, 0.5, 0.4, 0.3}, 5},
                                                 {{17, 33, 5, 0.5, 0.4, 0.3}, 1},
                                                 {{64, 64, 32, 0.5, 0.5, 0.5}, 2},
                                                 {{5, 3, 41, 0.5, 0.5, 0.1}, 33},
                                                 {{40, 40, 40, 0.5, 0.5, 1.5}, 1},
                                                 {{1, 300, 2, 0.5, 0.5, 0.5}, 9},
                                                 {{300, 1, 1, 0.5, 0.5, 0.5}, 4}};
  for (const auto& [block, count] : cases) {
    const Medium medium = random_medium(block, 30.0, 4);
    const FieldBatch b = random_fields(block, count, 5);
    const FieldBatch truth = solve(*reference, medium, b, 1e-10);
    for (const Precision precision : kPrecisions) {
      const auto host = make_host_solver({.threads = 3, .precision = precision});
      EXPECT_LT(worst_difference(solve(*host, medium, b, 1e-10), truth), 1e-7)
          << block.nx << "x" << block.ny << "x" << block.nz << ", " << count << " fields, "
          << to_string(precision);
    }
  }
}

TEST(HostSolver, GivesTheSameBitsWhateverTheNumberOfThreads) {
  const Block block{40, 24, 37, 0.5, 0.5, 0.5};
  const Medium medium = random_medium(block, 30.0, 4);
  const FieldBatch b = random_fields(block, 17, 5);
  for (const Precision precision : kPrecisions) {
    const FieldBatch one = solve(*make_host_solver({1, precision}), medium, b, 1e-6);
    for (const int threads : {2, 3, 7})
      EXPECT_EQ(solve(*make_host_solver({threads, precision}), medium, b, 1e-6).values, one.values)
          << threads << " threads, " << to_string(precision);
  }
}

// Planes of more than 384 KiB are cut, along x in the first block and across it in the second. One field alone is not:
// it takes the same iterations and ends at the same residual, give or take float32's rounding in the last of them.
TEST(HostSolver, SolvesInTilesAsItDoesInOnePiece) {
  const auto host = make_host_solver({.threads = 3});
  for (const Block& block :
       {Block{200, 32, 17, 0.5, 0.5, 0.5}, Block{48, 128, 130, 0.5, 0.5, 0.5}}) {
    const Medium medium = random_medium(block, 30.0, 4);
    const FieldBatch one = random_fields(block, 1, 5);
    FieldBatch nine(one.cells, 9);
    for (int m = 0; m < 9; ++m) std::copy_n(one.field(0), one.cells, nine.field(m));
    ASSERT_TRUE(host->prepare(medium));
    FieldBatch whole(one.cells, 1);
    FieldBatch tiled(one.cells, 9);
    const auto in_one_piece = host->solve(one, whole, {1e-8, 100}, {});
    const auto in_tiles = host->solve(nine, tiled, {1e-8, 100}, {});
    ASSERT_TRUE(in_one_piece && in_tiles);
    EXPECT_EQ(in_tiles->iterations, in_one_piece->iterations) << block.nx;
    EXPECT_NEAR(in_tiles->relative_residual / in_one_piece->relative_residual, 1.0, 0.1);
    EXPECT_LE(diffusion::testing::residual_of(medium, nine, tiled), 1e-8);
  }
}

// Light through one face of a block that hardly absorbs: so much fluence that, rounded to single precision, it is far
// from the tolerance. The solver keeps its corrections in single precision and must not need more iterations for it.
TEST(HostSolver, LosesNoIterationsToSinglePrecision) {
  const Block block{40, 40, 40, 0.02, 0.02, 0.02};
  Medium medium = random_medium(block, 30.0, 4);
  for (double& absorption : medium.absorption) absorption *= 1e-4;
  FieldBatch b(block.cell_count(), 4);
  for (int m = 0; m < b.count; ++m)
    for (int i = 0; i < 1600; ++i) b.field(m)[i] = i / 400 == m ? 1.0 : 0.0;
  for (const double tolerance : {1e-4, 1e-6, 1e-7, 1e-9, 1e-12}) {
    std::array<int, kPrecisions.size()> iterations{};
    for (std::size_t n = 0; n < kPrecisions.size(); ++n) {
      const auto host = make_host_solver({.threads = 2, .precision = kPrecisions[n]});
      ASSERT_TRUE(host->prepare(medium));
      FieldBatch phi(b.cells, b.count);
      const auto solved = host->solve(b, phi, {tolerance, 100}, {});
      ASSERT_TRUE(solved);
      EXPECT_LE(diffusion::testing::residual_of(medium, b, phi), tolerance);
      iterations[n] = solved->iterations;
      for (double& value : phi.values) value = static_cast<double>(static_cast<float>(value));
      if (tolerance <= 1e-6) {
        EXPECT_GT(diffusion::testing::residual_of(medium, b, phi), 4 * tolerance);
      }
    }
    EXPECT_LE(iterations[0], iterations[2] + 1) << tolerance;
    EXPECT_LE(iterations[1], iterations[2] + 1) << tolerance;
  }
}

// Tolerances near each other end now before, now behind the last half-sweep on x, and at a high contrast it now and then
// brings too little: whatever happens, the answer has the residual that was asked for, and iterations are saved.
TEST(HostSolver, FinishesWithAHalfSweep) {
  const Block block{24, 20, 16, 0.5, 0.5, 0.5};
  const auto host = make_host_solver({.threads = 2});
  const auto reference = diffusion::make_reference_solver();
  const FieldBatch b = random_fields(block, 4, 5);
  for (const double contrast : {10.0, 1e4}) {
    const Medium medium = random_medium(block, contrast, 4);
    ASSERT_TRUE(host->prepare(medium));
    ASSERT_TRUE(reference->prepare(medium));
    int saved = 0;
    int lost = 0;
    for (double tolerance = 1e-3; tolerance > 1e-7; tolerance *= 0.7) {
      FieldBatch phi(b.cells, b.count);
      FieldBatch expected(b.cells, b.count);
      const auto solved = host->solve(b, phi, {tolerance, 100}, {});
      const auto compared = reference->solve(b, expected, {tolerance, 100}, {});
      ASSERT_TRUE(solved && compared);
      EXPECT_EQ(solved->termination, diffusion::Termination::kConverged);
      const double residual = diffusion::testing::residual_of(medium, b, phi);
      EXPECT_LE(residual, tolerance);
      EXPECT_NEAR(residual / solved->relative_residual, 1.0, 1e-6) << contrast;
      saved += std::max(0, compared->iterations - solved->iterations);
      lost += std::max(0, solved->iterations - compared->iterations);
    }
    EXPECT_GE(saved, 5) << contrast;
    EXPECT_LE(lost, 2) << contrast;
  }
}

TEST(HostSolver, ServesOneMediumAfterAnother) {
  const auto host = make_host_solver({.threads = 2});
  for (const Block& block : {Block{20, 10, 30, 0.5, 0.5, 0.5}, Block{10, 20, 30, 0.5, 0.5, 0.5}})
    for (const unsigned seed : {1U, 2U}) {
      const Medium medium = random_medium(block, 30.0, seed);
      const FieldBatch b = random_fields(block, 2, seed);
      const FieldBatch fresh = solve(*make_host_solver({.threads = 2}), medium, b, 1e-8);
      EXPECT_EQ(solve(*host, medium, b, 1e-8).values, fresh.values);
    }
}

// Lanes that a smaller group leaves empty, and rows that lack a cell of one colour, keep nothing for the next one.
TEST(HostSolver, ServesOneGroupAfterAnother) {
  for (const Block& block : {Block{1, 8, 4, 1.0, 1.0, 1.0}, Block{5, 30, 9, 0.5, 0.5, 0.5}}) {
    const Medium medium = random_medium(block, 30.0, 3);
    const auto host = make_host_solver({.threads = 2});
    for (const int count : {16, 9, 13, 10}) {
      const FieldBatch b = random_fields(block, count, static_cast<unsigned>(count));
      const FieldBatch fresh = solve(*make_host_solver({.threads = 2}), medium, b, 1e-8);
      EXPECT_EQ(solve(*host, medium, b, 1e-8).values, fresh.values) << block.nx << ", " << count;
    }
  }
}

// The promise, 100 ms on a quiet machine, holds because the token is looked at once an iteration: four of them at most
// (the one under way and what the clock may be off on a busy machine), as long as they were measured here to take.
TEST(HostSolver, StopsWithinAnIterationOrTwo) {
  using Clock = std::chrono::steady_clock;
  const Block block{40, 40, 40, 0.5, 0.5, 0.5};
  const auto host = make_host_solver({.threads = 2});
  ASSERT_TRUE(host->prepare(random_medium(block, 1e6, 4)));
  const FieldBatch b = random_fields(block, 4, 5);
  FieldBatch phi(b.cells, b.count);
  const Clock::time_point begin = Clock::now();
  ASSERT_TRUE(host->solve(b, phi, {1e-14, 5}, {}));
  const auto iteration = (Clock::now() - begin) / 5;
  std::stop_source stop;
  Clock::time_point asked;
  std::jthread asker([&] {
    asked = Clock::now();
    stop.request_stop();
  });
  const Result<SolveSummary> solved = host->solve(b, phi, {1e-14, 100000}, stop.get_token());
  const Clock::time_point returned = Clock::now();
  asker.join();
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().code, ErrorCode::kCancelled);
  EXPECT_LT(returned - asked, 4 * iteration + std::chrono::milliseconds(500));
}

TEST(HostSolver, RefusesAnImpossibleNumberOfThreads) {
  EXPECT_TRUE(validate(HostOptions{}));
  EXPECT_EQ(validate(HostOptions{.threads = -1}).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace opaline::reconstruct::host

namespace opaline::reconstruct::diffusion::testing {
using opaline::reconstruct::host::TwoThreadsInDouble;
using opaline::reconstruct::host::TwoThreadsInHalf;
using opaline::reconstruct::host::TwoThreadsInSingle;
INSTANTIATE_TYPED_TEST_SUITE_P(HostInHalf, SolverTruths, TwoThreadsInHalf);
INSTANTIATE_TYPED_TEST_SUITE_P(HostInSingle, SolverTruths, TwoThreadsInSingle);
INSTANTIATE_TYPED_TEST_SUITE_P(HostInDouble, SolverTruths, TwoThreadsInDouble);
}  // namespace opaline::reconstruct::diffusion::testing
