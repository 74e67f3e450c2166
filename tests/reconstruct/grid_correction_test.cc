#include "reconstruct/grid_correction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/inverse/finite_elements.h"
#include "bench/inverse/transport_dataset.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "tests/support/direct_solver.h"

namespace opaline::reconstruct {
namespace {

constexpr double kThickness = 6.0;  // mm
constexpr double kScattering = 1.0;
constexpr double kAbsorption = 0.05;

// One column of a slab so wide that nothing leaves through its sides (1e-4 of a layer's exchange), diffusely lit from
// below with q = 1.
ChannelProblem slab(int layers) {
  ChannelProblem problem;
  problem.block = {1, 1, layers, 1e4, 1e4, kThickness / layers};
  problem.boundary = *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3);
  problem.source.model = diffusion::SourceModel::kSurface;
  problem.camera = {diffusion::camera_equation(1.3, problem.boundary, 1.0)};
  problem.illuminations = {{.irradiance = {1.0}, .radiance = {1.0}, .weight = {1.0}}};
  return problem;
}

ChannelCoefficients coefficients(int layers) {
  const auto cells = static_cast<std::size_t>(layers);
  return {std::vector<double>(cells, kAbsorption), std::vector<double>(cells, kScattering)};
}

// -kappa phi'' + sigma_a phi = 0, phi - 2 A kappa phi' = S at 0, phi + 2 A kappa phi' = 0 at the far face, where
// J_n = phi / (2 A); with phi = P cosh k(D - z) + Q sinh k(D - z) the far condition is P = 2 A kappa k Q.
double exact_radiance(const ChannelProblem& problem) {
  const double kappa = 1.0 / (3.0 * (kScattering + kAbsorption));
  const double k = std::sqrt(kAbsorption / kappa);
  const double e = 2.0 * problem.boundary.a * kappa * k;
  const double cosh = std::cosh(k * kThickness);
  const double sinh = std::sinh(k * kThickness);
  const double q = problem.boundary.source_scale / (2.0 * e * cosh + (1.0 + e * e) * sinh);
  return problem.camera[0].flux_gain * e * q / (2.0 * problem.boundary.a);
}

// Of second order before, of fourth or more after: halving the cells leaves a quarter, and at most a sixteenth of what was
// left; a fifth of each is allowed for what is of still higher order.
TEST(GridCorrection, RaisesTheOrderOfASlabsTransmittanceFromTwoToFour) {
  double before = 0.0;
  double after = 0.0;
  for (const int layers : {6, 12}) {
    const ChannelProblem problem = slab(layers);
    testing_support::DirectSolver solver;
    const auto correction = grid_correction(problem, coefficients(layers), 1e-10, solver, {});
    ASSERT_TRUE(correction) << correction.error().message;
    const double exact = exact_radiance(problem);
    const double own = correction->predicted[0][0] / exact - 1.0;
    const double left = (correction->predicted[0][0] + correction->change[0][0]) / exact - 1.0;
    EXPECT_LT(std::abs(left), 0.1 * std::abs(own)) << layers;
    if (layers == 12) {
      EXPECT_NEAR(own / before, 1.0 / 4.0, 0.2 / 4.0);
      EXPECT_LT(left / after, 1.2 / 16.0);
    }
    before = own;
    after = left;
  }
}

TEST(GridCorrection, IsTakenOffThePicturesAndMeasuredWhereTheyAreUsable) {
  ChannelProblem problem = slab(1);
  problem.illuminations[0].radiance = {5.0, 7.0};
  problem.illuminations[0].weight = {1.0, 0.0};
  const GridCorrection correction{{{2.0, 1.0}}, {{1.0, 4.0}}};
  EXPECT_EQ(corrected(problem, correction).illuminations[0].radiance,
            (std::vector<double>{4.0, 3.0}));
  EXPECT_EQ(power(problem, correction).relative(), 1.0 / 3.0);
}

TEST(GridCorrection, IsLeftOutWhereItIsNotAskedForOrCannotBe) {
  const Block block{10, 10, 10, 1.0, 1.0, 1.0};
  InverseOptions options;
  EXPECT_FALSE(corrects_grid(options, block));
  options.grid_correction = true;
  EXPECT_TRUE(corrects_grid(options, block));
  EXPECT_FALSE(corrects_grid(options, {256, 256, 20, 1.0, 1.0, 1.0}));
  options.structure = Structure::kShared;
  EXPECT_FALSE(corrects_grid(options, block));
}

// Waves of both coefficients, 24 cells long: kappa varies by 3, sigma_a by 4.
Material wavy(const Block& block) {
  Material material;
  material.block = block;
  material.ior = 1.3;
  for (ChannelCoefficients& c : material.channels)
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        for (int i = 0; i < block.nx; ++i) {
          const double wave = std::cos(0.26 * (i + j + 2 * k));
          c.reduced_scattering.push_back(1.6 * std::exp(0.5 * wave));
          c.absorption.push_back(0.02 * std::exp(-0.7 * wave));
        }
  return material;
}

double error(const Dataset& dataset, const Material& material, bool corrects) {
  const auto solver = diffusion::make_reference_solver();
  const auto pictures =
      predict(dataset, material, {.grid_correction = corrects, .tolerance = 1e-8}, *solver, {});
  EXPECT_TRUE(pictures);
  return pictures ? relighting_error(dataset, *pictures, true).error : 0.0;
}

// Trilinear finite elements, three to a cell along each axis, share nothing with the volumes (bench/inverse).
TEST(GridCorrection, BringsPredictionsFourTimesCloserToFiniteElements) {
  const Material material = wavy({12, 12, 6, 0.5, 0.5, 0.5});
  const Dataset dataset =
      bench::patch_dataset(bench::finite_element_responses(material, 3, {3, 3, 3}));
  const double own = error(dataset, material, false);
  EXPECT_GT(own, 0.002);
  EXPECT_LT(error(dataset, material, true), own / 4.0);
}

}  // namespace
}  // namespace opaline::reconstruct
