#include "reconstruct/posterior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "reconstruct/objective.h"
#include "reconstruct/prior.h"
#include "reconstruct/resample.h"
#include "reconstruct/tangent.h"
#include "tests/reconstruct/support/random_problem.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

using namespace testing_problem;  // NOLINT(google-build-using-namespace)
using Eigen::Index;
using Eigen::MatrixXd;

// The covariance of docs written down again, mode by mode over explicit cell positions.
MatrixXd prior_covariance(const Block& b, const PriorOptions& prior, double length) {
  const auto cells = static_cast<Index>(b.cell_count());
  MatrixXd sum = MatrixXd::Zero(cells, cells);
  const auto cosine = [](int k, int i, int n) {
    return std::cos(std::numbers::pi * k * (2 * i + 1) / (2.0 * n));
  };
  const auto eigenvalue = [](int k, int n, double h) {
    return 4.0 / (h * h) * std::pow(std::sin(std::numbers::pi * k / (2.0 * n)), 2);
  };
  for (int w = 0; w < b.nz; ++w)
    for (int v = 0; v < b.ny; ++v)
      for (int u = 0; u < b.nx; ++u) {
        Eigen::VectorXd mode(cells);
        for (int k = 0; k < b.nz; ++k)
          for (int j = 0; j < b.ny; ++j)
            for (int i = 0; i < b.nx; ++i)
              mode[static_cast<Index>(b.index(i, j, k))] =
                  cosine(u, i, b.nx) * cosine(v, j, b.ny) * cosine(w, k, b.nz);
        const double lambda =
            eigenvalue(u, b.nx, b.hx) + eigenvalue(v, b.ny, b.hy) + eigenvalue(w, b.nz, b.hz);
        sum += std::pow(1.0 / (length * length) + lambda, -2) / mode.squaredNorm() * mode *
               mode.transpose();
      }
  const Eigen::VectorXd scale = prior.amplitude * sum.diagonal().cwiseSqrt().cwiseInverse();
  sum = scale.asDiagonal() * sum * scale.asDiagonal();
  sum.array() += prior.level * prior.level;
  return sum;
}

/// J over all cells, column by column: (log kappa, log sigma_a); sqrt(w) L.
MatrixXd jacobian(Tangent& tangent, const ChannelCoefficients& c) {
  const auto cells = static_cast<Index>(c.absorption.size());
  MatrixXd j(static_cast<Index>(tangent.data_count()), 2 * cells);
  for (Index i = 0; i < cells; ++i) {
    const double absorbed = c.absorption[i];
    const double scattered = c.reduced_scattering[i];
    std::vector<double> v(static_cast<std::size_t>(2 * cells), 0.0);
    v[i] = -(absorbed + scattered) / scattered;  // log kappa up, sigma_a as it is
    const auto by_diffusion = *tangent.apply(v, {});
    v[i] = -absorbed / scattered;  // log sigma_a up, kappa as it is
    v[cells + i] = 1.0;
    const auto by_absorption = *tangent.apply(v, {});
    for (Index d = 0; d < j.rows(); ++d) {
      j(d, i) = by_diffusion[d];
      j(d, cells + i) = by_absorption[d];
    }
  }
  return j;
}

double along(const Block& b, int axis) { return b.cells()[axis] * b.spacing()[axis]; }

// 1 + eps^2 E E^T of DiscrepancyShapes, datum by datum: half waves no shorter than the block is thick.
MatrixXd data_covariance(const ChannelProblem& problem, double discrepancy) {
  const Block& b = problem.block;
  const Face seen = problem.seen_face;
  const int width = b.face_width(seen);
  const int height = b.face_height(seen);
  const int axis = axis_of(seen);
  const double thick = along(b, axis);
  const int nu = std::min(width, 1 + static_cast<int>(along(b, axis == 0 ? 1 : 0) / thick + 1e-9));
  const int nv = std::min(height, 1 + static_cast<int>(along(b, axis == 2 ? 1 : 2) / thick + 1e-9));
  const auto data = static_cast<Index>(problem.illuminations.size()) * width * height;
  const auto wave = [](int k, int i, int n) {
    return (k == 0 ? 1.0 : std::sqrt(2.0)) *
           std::cos(std::numbers::pi * k * (2 * i + 1) / (2.0 * n));
  };
  Eigen::VectorXd scale(data);
  for (std::size_t m = 0; m < problem.illuminations.size(); ++m) {
    const auto& [q, radiance, weight, noise] = problem.illuminations[m];
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t x = 0; x < weight.size(); ++x) {
      sum += weight[x] > 0.0 ? radiance[x] * radiance[x] : 0.0;
      count += weight[x] > 0.0 ? 1.0 : 0.0;
    }
    for (std::size_t x = 0; x < weight.size(); ++x)
      scale[static_cast<Index>(m * weight.size() + x)] =
          std::sqrt(weight[x] * (radiance[x] * radiance[x] + sum / count));
  }
  MatrixXd r = MatrixXd::Identity(data, data);
  const int pixels = width * height;
  for (Index d = 0; d < data; ++d)
    for (Index e = 0; e < data; ++e) {
      const int x = static_cast<int>(d % pixels);
      const int y = static_cast<int>(e % pixels);
      double alike = 0.0;
      for (int u = 0; u < nu; ++u)
        for (int v = 0; v < nv; ++v)
          alike += wave(u, x % width, width) * wave(u, y % width, width) *
                   wave(v, x / width, height) * wave(v, y / width, height) / (nu * nv);
      const double share = d / pixels == e / pixels ? 1.0 : 0.25;
      r(d, e) += discrepancy * discrepancy * share * scale[d] * scale[e] * alike;
    }
  return r;
}

struct Gaussian {
  MatrixXd covariance;
  double picture_variance;  // of the unweighted radiances, summed
  Eigen::VectorXd shift;    // of the mean, from the estimate
};

/// Of (log kappa, log sigma_a) of all cells given the data, the prior about each one's mean.
Gaussian conditional(const ChannelProblem& problem,
                     const ChannelCoefficients& c,
                     const PosteriorOptions& options) {
  testing_support::DirectSolver solver;
  Tangent tangent = *Tangent::at(problem, solver, c, 1e-12, {});
  const MatrixXd j = jacobian(tangent, c);
  const auto residual = tangent.residual();
  const auto cells = static_cast<Index>(problem.block.cell_count());
  Eigen::VectorXd from_mean(2 * cells);
  for (Index i = 0; i < cells; ++i) {
    from_mean[i] = -std::log(c.absorption[i] + c.reduced_scattering[i]);
    from_mean[cells + i] = std::log(c.absorption[i]);
  }
  from_mean.head(cells).array() -= from_mean.head(cells).mean();
  from_mean.tail(cells).array() -= from_mean.tail(cells).mean();
  MatrixXd prior = MatrixXd::Zero(2 * cells, 2 * cells);
  prior.topLeftCorner(cells, cells) =
      prior_covariance(problem.block, options.diffusion, options.length_mm);
  prior.bottomRightCorner(cells, cells) =
      prior_covariance(problem.block, options.absorption, options.length_mm);
  const MatrixXd gain =
      prior * j.transpose() *
      (data_covariance(problem, options.discrepancy) + j * prior * j.transpose()).inverse();
  const Eigen::VectorXd misfit =
      j * from_mean - Eigen::Map<const Eigen::VectorXd>(residual.data(), j.rows());
  const MatrixXd covariance = prior - gain * j * prior;
  const Eigen::VectorXd whitened = (j * covariance * j.transpose()).diagonal();
  double variance = 0.0;
  Index d = 0;
  for (const auto& i : problem.illuminations)
    for (const double w : i.weight) {
      if (w > 0.0) variance += whitened[d] / w;
      ++d;
    }
  return {covariance, variance, gain * misfit - from_mean};
}

class PosteriorOf : public testing::TestWithParam<Case> {};

// All cosines and the block's own cells: nothing is left out, so what is left is rounding and the direct solver's.
TEST_P(PosteriorOf, IsTheGaussianConditionalWrittenDownInCells) {
  ChannelProblem problem = random_problem(GetParam());
  for (auto& i : problem.illuminations)
    for (double& w : i.weight) w *= 1e3;
  const ChannelCoefficients c = random_medium(problem.block.cell_count(), 3);
  const PosteriorOptions options{.find_amplitude = false, .discrepancy = 0.02};
  testing_support::DirectSolver solver;
  ChannelProblem unweighted = problem;
  for (auto& i : unweighted.illuminations)
    for (double& w : i.weight) w = w > 0.0 ? 1.0 : 0.0;
  const auto found = posterior(problem, unweighted, solver, c, options, {});
  ASSERT_TRUE(found) << found.error().message;
  const auto [expected, picture_variance, shift] = conditional(problem, c, options);
  EXPECT_NEAR(found->held_out_variance, picture_variance, 1e-6 * picture_variance);
  const auto cells = static_cast<Index>(problem.block.cell_count());
  double tightest = 1.0;
  for (Index i = 0; i < cells; ++i) {
    const auto cell = static_cast<std::size_t>(i);
    EXPECT_NEAR(found->shift.diffusion[cell], shift[i], 1e-6);
    EXPECT_NEAR(found->shift.absorption[cell], shift[cells + i], 1e-6);
    const double k = std::hypot(std::sqrt(expected(i, i)), shift[i]);
    const double a = std::hypot(std::sqrt(expected(cells + i, cells + i)), shift[cells + i]);
    const double both = expected(i, cells + i) + shift[i] * shift[cells + i];
    const double by_k =
        -(c.absorption[cell] + c.reduced_scattering[cell]) / c.reduced_scattering[cell];
    const double by_a = -c.absorption[cell] / c.reduced_scattering[cell];
    const double s = std::sqrt(by_k * by_k * k * k + by_a * by_a * a * a + 2 * by_k * by_a * both);
    EXPECT_NEAR(found->deviation.diffusion[cell], k, 1e-6 * k);
    EXPECT_NEAR(found->deviation.absorption[cell], a, 1e-6 * a);
    EXPECT_NEAR(found->deviation.reduced_scattering[cell], s, 1e-6 * s);
    tightest = std::min(tightest,
                        std::sqrt(expected(i, i)) /
                            std::hypot(options.diffusion.level, options.diffusion.amplitude));
  }
  EXPECT_LT(tightest,
            0.5);  // or the pictures would say nothing and the prior would agree with itself
}

INSTANTIATE_TEST_SUITE_P(Light, PosteriorOf, kEveryLight, case_name);
INSTANTIATE_TEST_SUITE_P(Rays, PosteriorOf, kEveryLightAlongRays, case_name);

const Case kBackLit{"", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 0.0};

TEST(Posterior, IsThePriorWhereNothingWasMeasured) {
  ChannelProblem problem = random_problem(kBackLit);
  for (auto& i : problem.illuminations) std::fill(i.weight.begin(), i.weight.end(), 1e-20);
  testing_support::DirectSolver solver;
  PosteriorOptions options;
  options.find_amplitude = false;
  const ChannelCoefficients c = random_medium(problem.block.cell_count(), 3);
  const auto found = *posterior(problem, solver, c, options, {});
  double mean = 0.0;
  for (const double a : c.absorption)
    mean += std::log(a) / static_cast<double>(c.absorption.size());
  for (std::size_t i = 0; i < c.absorption.size(); ++i) {
    const double from_mean = std::log(c.absorption[i]) - mean;
    EXPECT_NEAR(found.shift.absorption[i], -from_mean, 1e-9);
    EXPECT_NEAR(found.deviation.absorption[i],
                std::hypot(options.absorption.level, options.absorption.amplitude, from_mean),
                1e-9);
    EXPECT_NEAR(
        found.deviation.diffusion[i],
        std::hypot(options.diffusion.level, options.diffusion.amplitude, found.shift.diffusion[i]),
        1e-9);
    const double step = 1e-6;
    const double moved =
        (c.absorption[i] + c.reduced_scattering[i]) * std::exp(-step * found.shift.diffusion[i]) -
        c.absorption[i] * std::exp(step * found.shift.absorption[i]);
    EXPECT_NEAR(
        found.shift.reduced_scattering[i], std::log(moved / c.reduced_scattering[i]) / step, 1e-4);
  }
  EXPECT_NEAR(found.determined_diffusion + found.determined_absorption, 0.0, 1e-9);
}

// Independent noise is averaged out over a picture, a smooth discrepancy is not.
TEST(Posterior, KnowsLessWhereTheModelErrsSmoothly) {
  const ChannelProblem problem = random_problem(kBackLit);
  testing_support::DirectSolver solver;
  const ChannelCoefficients c = random_medium(problem.block.cell_count(), 3);
  const auto determined = [&](double discrepancy) {
    const PosteriorOptions options{.find_amplitude = false, .discrepancy = discrepancy};
    const auto found = posterior(problem, solver, c, options, {});
    return found->determined_diffusion + found->determined_absorption;
  };
  const double without = determined(0.0);
  EXPECT_LT(determined(0.1), without);
  EXPECT_LT(determined(0.3), determined(0.1));
}

// The evidence is that of a marginal likelihood: fields drawn from amplitudes a factor of three apart are told apart.
TEST(Posterior, FindsTheAmplitudeThatTheDataWereDrawnWith) {
  ChannelProblem problem = random_problem(kBackLit);
  const auto cells = problem.block.cell_count();
  for (auto& i : problem.illuminations) std::fill(i.weight.begin(), i.weight.end(), 1e9);
  testing_support::DirectSolver solver;
  std::vector<double> found;
  for (const double amplitude : {0.05, 0.3}) {
    const MatrixXd covariance = prior_covariance(problem.block, {0.0, amplitude}, 2.0);
    const Eigen::LLT<MatrixXd> factors(
        covariance + 1e-12 * MatrixXd::Identity(covariance.rows(), covariance.cols()));
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    Eigen::VectorXd xi(covariance.rows());
    for (double& x : xi) x = normal(random);
    const Eigen::VectorXd u = factors.matrixL() * xi;
    ChannelCoefficients c{std::vector<double>(cells, 0.01), {}};
    for (const double v : u) c.reduced_scattering.push_back(1.2 * std::exp(-v));
    Objective objective(problem, solver, {});
    const auto pictures = *objective.predict(c, {});
    for (std::size_t m = 0; m < pictures.size(); ++m)
      problem.illuminations[m].radiance = pictures[m];
    found.push_back(posterior(problem, solver, c, {}, {})->diffusion.amplitude);
  }
  EXPECT_GT(found[0], 0.05 / 1.6);
  EXPECT_LT(found[0], 0.05 * 1.6);
  EXPECT_GT(found[1], 0.3 / 1.6);
  EXPECT_LT(found[1], 0.3 * 1.6);
}

TEST(Posterior, RefusesOptionsThatMeanNothing) {
  const ChannelProblem problem = random_problem(kBackLit);
  testing_support::DirectSolver solver;
  PosteriorOptions options;
  options.length_mm = 0.0;
  const auto found =
      posterior(problem, solver, random_medium(problem.block.cell_count(), 3), options, {});
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("length_mm = 0; expected > 0"));
}

TEST(Posterior, StopsWhenAsked) {
  const ChannelProblem problem = random_problem(kBackLit);
  testing_support::DirectSolver solver;
  std::stop_source stop;
  stop.request_stop();
  const auto found = posterior(
      problem, solver, random_medium(problem.block.cell_count(), 3), {}, stop.get_token());
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kCancelled);
}

// Exact: means of a linear function over any cells, and what lies between centres of one.
TEST(Resample, KeepsMeansAndLinearFunctions) {
  const Block block{7, 5, 6, 0.5, 1.0, 0.25};
  const Block coarse = coarser_block(block, 40);
  EXPECT_LE(coarse.cell_count(), 40U);
  EXPECT_NEAR(coarse.size().x, block.size().x, 1e-12);
  const auto linear = [](const Block& b) {
    std::vector<double> u;
    for (int k = 0; k < b.nz; ++k)
      for (int j = 0; j < b.ny; ++j)
        for (int i = 0; i < b.nx; ++i)
          u.push_back(3.0 + (i + 0.5) * b.hx - 2.0 * (j + 0.5) * b.hy + (k + 0.5) * b.hz);
    return u;
  };
  const auto averaged = average_cells(block, coarse, linear(block));
  const auto expected = linear(coarse);
  double mean = 0.0;
  for (std::size_t i = 0; i < averaged.size(); ++i) mean += averaged[i] - expected[i];
  EXPECT_NEAR(mean, 0.0, 1e-10);
  const auto back = interpolate_cells(coarse, block, expected);
  EXPECT_NEAR(back[block.index(3, 2, 3)], linear(block)[block.index(3, 2, 3)], 1e-12);
}

}  // namespace
}  // namespace opaline::reconstruct
