#include "render/solver/sweep_matrix.h"

#include <gmock/gmock.h>

#include <cmath>
#include <optional>

#include "tests/render/solver/lane_grid.h"

namespace opaline::render {
namespace {

constexpr double kRough = 1e-6;  // rough entries of a double are floats

double product(const std::vector<Lanes<double>>& a, const std::vector<Lanes<double>>& b, int c) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i][c] * b[i][c];
  return sum;
}

/// In one block, and in several that seams join. An entry of either sign: finite elements have both.
class SweepMatrixOf : public testing::TestWithParam<int> {
 protected:
  SweepMatrixOf() : a_(grid<double>(19, 10.0)) {
    for (int i = 0; i < a_.rows(); ++i)
      for (int e = a_.starts[i]; e < a_.starts[i + 1]; ++e)
        if (std::abs(a_.columns[e] - i) == 1 && (i + a_.columns[e]) % 5 == 0) a_.entries[e] *= -0.2;
    sweeps_.emplace(a_, GetParam(), true);
    team_.emplace(GetParam());
  }

  std::vector<Lanes<double>> times(const std::vector<Lanes<double>>& x) const {
    std::vector<Lanes<double>> product;
    for (int i = 0; i < a_.rows(); ++i) product.push_back(apply_row(a_, x.data(), i));
    return product;
  }
  std::vector<Lanes<double>> up(const std::vector<Lanes<double>>& r,
                                std::vector<Lanes<double>>& rest) {
    auto x = dark<double>(a_.rows());
    sweeps_->over_blocks(*team_, [&](int block) { sweeps_->sweep_up(block, r, x, rest); });
    sweeps_->over_blocks(*team_, [&](int block) { sweeps_->add_seams_to_rest(block, x, rest); });
    return x;
  }
  Lanes<double> down(const std::vector<Lanes<double>>& r, std::vector<Lanes<double>>& x) {
    sweeps_->over_blocks(*team_, [&](int block) { sweeps_->hear_seams(block, x, heard_); });
    return sweeps_->sum_over_blocks(
        *team_, [&](int block) { return sweeps_->sweep_down(block, r, heard_, x); });
  }

  LaneMatrix<double> a_;
  std::optional<SweepMatrix<double>> sweeps_;
  std::optional<ThreadTeam> team_;
  std::vector<Lanes<double>> heard_ = dark<double>(a_.rows());
};

TEST_P(SweepMatrixOf, MultipliesAsItsMatrixDoes) {
  ASSERT_EQ(sweeps_->blocks(), GetParam());
  auto x = random_field<double>(a_.rows(), 1);
  const auto expected = times(x);
  auto found = dark<double>(a_.rows());
  const auto as_it_is = [](int) {};
  Lanes<double> energy = sweeps_->sum_over_blocks(
      *team_, [&](int block) { return sweeps_->multiply(block, as_it_is, x, found); });
  energy += sweeps_->sum_over_blocks(
      *team_, [&](int block) { return sweeps_->multiply_seams(block, x, found); });
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < a_.rows(); ++i) ASSERT_NEAR(found[i][c], expected[i][c], 1e-11);
    EXPECT_NEAR(energy[c] / product(x, expected, c), 1.0, 1e-12);
  }
}

TEST_P(SweepMatrixOf, KnowsWhatASweepUpLeaves) {
  const auto r = random_field<double>(a_.rows(), 2);
  auto rest = dark<double>(a_.rows());
  const auto ax = times(up(r, rest));
  for (int i = 0; i < a_.rows(); ++i)
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(rest[i][c], r[i][c] - ax[i][c], kRough);
}

TEST_P(SweepMatrixOf, SweepsDownAsTheAdjointOfUp) {
  const auto r = random_field<double>(a_.rows(), 3);
  const auto s = random_field<double>(a_.rows(), 4);
  auto rest = dark<double>(a_.rows());
  const auto up_r = up(r, rest);
  auto down_s = dark<double>(a_.rows());
  const Lanes<double> answer = down(s, down_s);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(product(up_r, s, c) / product(r, down_s, c), 1.0, 1e-12);
    EXPECT_NEAR(answer[c] / product(s, down_s, c), 1.0, 1e-12);
    for (const auto& left : heard_) ASSERT_EQ(left[c], 0.0);
  }
}

TEST_P(SweepMatrixOf, MeansTheSameMatrixUpAndDown) {
  auto r = random_field<double>(a_.rows(), 6);
  auto rest = dark<double>(a_.rows());
  const auto x = up(r, rest);
  for (int i = 0; i < a_.rows(); ++i) r[i] -= rest[i];
  auto same = x;
  down(r, same);
  for (int i = 0; i < a_.rows(); ++i)
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(same[i][c], x[i][c], 1e-13);
}

TEST_P(SweepMatrixOf, StaysAtTheSolutionAndComesNearerFromElsewhere) {
  const auto exact = random_field<double>(a_.rows(), 5);
  const auto r = times(exact);
  auto x = exact;
  down(r, x);
  for (int i = 0; i < a_.rows(); ++i)
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(x[i][c], exact[i][c], kRough);
  const auto energy_of_error = [&](const std::vector<Lanes<double>>& at, int c) {
    auto error = at;
    for (int i = 0; i < a_.rows(); ++i) error[i] -= exact[i];
    return product(error, times(error), c);
  };
  x = dark<double>(a_.rows());
  for (int sweep = 0; sweep < 3; ++sweep) {
    const auto before = x;
    down(r, x);
    for (int c = 0; c < 3; ++c)
      EXPECT_LT(energy_of_error(x, c), 0.9 * energy_of_error(before, c)) << sweep;
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, SweepMatrixOf, testing::Values(1, 2, 3));

}  // namespace
}  // namespace opaline::render
