#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "reconstruct/objective.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

struct Case {
  const char* name;
  diffusion::SourceModel source;
  diffusion::Deposit deposit;
  Face lit;
  Face seen;
  double regularization;
};

std::string case_name(const testing::TestParamInfo<Case>& info) { return info.param.name; }

ChannelCoefficients random_medium(std::size_t cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> scattering(0.5, 4.0);
  std::uniform_real_distribution<double> absorption(0.005, 0.2);
  ChannelCoefficients c;
  for (std::size_t i = 0; i < cells; ++i) {
    c.reduced_scattering.push_back(scattering(random));
    c.absorption.push_back(absorption(random));
  }
  return c;
}

// Two illuminations of a 6 x 5 x 4 block of anisotropic cells, seen obliquely, with random data,
// weights and mask.
ChannelProblem random_problem(const Case& c) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.2, 1.0);
  ChannelProblem problem{
      .block = {6, 5, 4, 0.5, 0.6, 0.4},
      .lit_face = c.lit,
      .seen_face = c.seen,
      .boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3),
      .source = {c.source, c.deposit},
      .camera = {},
      .illuminations = std::vector<ChannelIllumination>(2),
      .data_count = 0};
  const std::size_t seen = problem.block.face_cell_count(c.seen);
  for (std::size_t x = 0; x < seen; ++x) {
    problem.camera.push_back(diffusion::camera_equation(1.3, problem.boundary, uniform(random)));
  }
  for (ChannelIllumination& i : problem.illuminations) {
    for (std::size_t x = 0; x < problem.block.face_cell_count(c.lit); ++x) {
      i.irradiance.push_back(uniform(random) > 0.5 ? uniform(random) : 0.0);
    }
    for (std::size_t x = 0; x < seen; ++x) {
      i.radiance.push_back(0.02 * uniform(random));
      i.weight.push_back(uniform(random) > 0.3 ? 1e3 * uniform(random) : 0.0);
    }
  }
  return problem;
}

class Gradient : public testing::TestWithParam<Case> {
 protected:
  double value(std::span<const double> p) { return objective_.evaluate(p, {})->value; }

  // Richardson: (8 (J(h) - J(-h)) - (J(2h) - J(-2h))) / 12 h, error O(h^4).
  double difference(std::vector<double> p, std::size_t i, double h) {
    const double at = p[i];
    const auto moved = [&](double step) {
      p[i] = at + step;
      return value(p);
    };
    return (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
  }

  ChannelProblem problem_ = random_problem(GetParam());
  testing_support::DirectSolver solver_;
  Objective objective_{problem_, solver_, {.regularization = GetParam().regularization}};
};

// Each component against its own size. h = 2e-3 leaves h^4 = 2e-11 of truncation; the rounding of J, 1e-15 of it, is
// divided by h and must stay 1e-6 of the component, so a component is resolved from 1e-6 J on.
TEST_P(Gradient, MatchesRichardsonDifferencesInEveryParameter) {
  const std::size_t cells = problem_.block.cell_count();
  const std::vector<double> p = to_parameters(random_medium(cells, 3));
  const Evaluation at = *objective_.evaluate(p, {});
  const double resolved = 1e-6 * at.value;
  double worst = 0.0;
  std::size_t unresolved = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double expected = difference(p, i, 2e-3);
    unresolved += std::abs(expected) < resolved ? 1 : 0;
    const double error = std::abs(at.gradient[i] - expected);
    worst = std::max(worst, error / std::max(std::abs(expected), resolved));
    EXPECT_LE(error, 1e-6 * std::max(std::abs(expected), resolved)) << "parameter " << i;
  }
  std::printf("worst component: %.1e of itself; %zu of %zu too small to tell\n",
              worst,
              unresolved,
              p.size());
  EXPECT_LE(unresolved, p.size() / 50);
}

constexpr auto kCollimated = diffusion::SourceModel::kCollimated;
constexpr auto kSurface = diffusion::SourceModel::kSurface;
constexpr auto kCentroid = diffusion::Deposit::kCentroid;
constexpr auto kCell = diffusion::Deposit::kCell;

INSTANTIATE_TEST_SUITE_P(
    Light,
    Gradient,
    testing::Values(Case{"BackLitCentroid", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 0.0},
                    Case{"BackLitCell", kCollimated, kCell, Face::kZMin, Face::kZMax, 0.0},
                    Case{"BackLitSurface", kSurface, kCentroid, Face::kZMin, Face::kZMax, 0.0},
                    Case{"FrontLitCentroid", kCollimated, kCentroid, Face::kZMax, Face::kZMax, 0.0},
                    Case{"FrontLitCell", kCollimated, kCell, Face::kZMax, Face::kZMax, 0.0},
                    Case{"FrontLitSurface", kSurface, kCentroid, Face::kZMax, Face::kZMax, 0.0},
                    Case{"FromTheSide", kCollimated, kCentroid, Face::kXMax, Face::kYMin, 0.0},
                    Case{"Regularized", kCollimated, kCentroid, Face::kZMin, Face::kZMax, 2.0}),
    case_name);

}  // namespace
}  // namespace opaline::reconstruct
