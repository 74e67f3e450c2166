// Whole reconstructions at the extremes: each is right to a stated error, or an error that says why. The data come from
// a direct solution on a grid twice as fine (tests/support/synthetic_dataset.h).

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/prediction.h"
#include "reconstruct/relighting_error.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using testing_support::Coefficients;
using testing_support::make_synthetic_dataset;
using testing_support::synthetic_coefficients;
using testing_support::SyntheticOptions;

constexpr double kNineLights = 0.035;

struct ExtremeSample {
  const char* name;
  SyntheticOptions sample;
  CoefficientBounds reduced_scattering{0.02, 100.0};
};

InverseOptions options_of(const ExtremeSample& extreme) {
  InverseOptions options;
  options.reduced_scattering = extreme.reduced_scattering;
  return options;
}

/// The true coefficients at the cell centres: what the grid of the reconstruction can hold of them.
Material truth_of(const SyntheticOptions& sample) {
  Material material;
  material.block = sample.block;
  material.ior = sample.ior;
  const Block& b = sample.block;
  for (int c = 0; c < kColorChannels; ++c)
    for (int k = 0; k < b.nz; ++k)
      for (int j = 0; j < b.ny; ++j)
        for (int i = 0; i < b.nx; ++i) {
          const Vec3 centre{(i + 0.5) * b.hx, (j + 0.5) * b.hy, (k + 0.5) * b.hz};
          const Coefficients here = synthetic_coefficients(sample, centre, c);
          auto& channel = material.channels[static_cast<std::size_t>(c)];
          channel.reduced_scattering.push_back(here.reduced_scattering);
          channel.absorption.push_back(here.absorption);
        }
  return material;
}

Coefficients everyday(Vec3 p, int channel) { return synthetic_coefficients({}, p, channel); }

SyntheticOptions plain() { return {.block = {8, 8, 4, 1.0, 1.0, 1.0}, .regions = 3}; }

SyntheticOptions with(std::function<Coefficients(Vec3, int)> coefficients) {
  SyntheticOptions options = plain();
  options.coefficients = std::move(coefficients);
  return options;
}

SyntheticOptions sized(const Block& block) {
  SyntheticOptions options = plain();
  options.block = block;
  return options;
}

SyntheticOptions of_index(double ior) {
  SyntheticOptions options = plain();
  options.ior = ior;
  return options;
}

// A film of 0.04 mm, in voxels a hundred times as wide as they are thick.
SyntheticOptions flat(double scattering) {
  SyntheticOptions options = sized({8, 8, 4, 1.0, 1.0, 0.01});
  options.coefficients = [=](Vec3 p, int c) -> Coefficients {
    return {scattering * everyday({p.x, p.y, 0.0}, c).reduced_scattering, 0.01 * scattering};
  };
  return options;
}

class ExtremeSamples : public ::testing::TestWithParam<ExtremeSample> {
 protected:
  Result<InverseResult> invert(const Dataset& dataset, const InverseOptions& options) {
    NullSink events;
    const SystemClock clock;
    return reconstruct_material(dataset, options, {*solver_, events, clock}, {});
  }
  std::unique_ptr<diffusion::FluenceSolver> solver_ = host::make_host_solver({.threads = 2});
};

void expect_within_bounds(const InverseResult& result, const InverseOptions& options) {
  const auto within = [](const std::vector<double>& values, const CoefficientBounds& bounds) {
    return std::ranges::all_of(values, [&](double v) {
      return v >= bounds.lowest * (1.0 - 1e-9) && v <= bounds.highest * (1.0 + 1e-9);
    });
  };
  for (const ChannelCoefficients& c : result.material.channels) {
    EXPECT_TRUE(within(c.absorption, options.absorption));
    EXPECT_TRUE(within(c.reduced_scattering, options.reduced_scattering));
  }
}

// What may be asked of a fit: no worse than what is best of the homogeneous sample and of the true coefficients on this
// grid, which is twice as coarse as the data's; than noise; and than the 3.5 % that nine lights leave open about the ones
// between them, as they do of the everyday sample. Half of that in hand.
TEST_P(ExtremeSamples, AreRelitAsWellAsCanBeAsked) {
  const Dataset dataset = make_synthetic_dataset(GetParam().sample);
  const InverseOptions options = options_of(GetParam());
  InverseOptions two_numbers = options;
  two_numbers.max_iterations = 0;
  const auto result = invert(dataset, options);
  const auto homogeneous = invert(dataset, two_numbers);
  const auto ideal = predict(dataset, truth_of(GetParam().sample), options, *solver_, {});
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_TRUE(homogeneous && ideal);
  expect_within_bounds(*result, options);
  const RelightingError grid = relighting_error(dataset, *ideal, true);
  const double best = std::min(grid.error, homogeneous->held_out.error);
  EXPECT_LE(result->held_out.error, 1.5 * std::max({best, grid.noise_floor, kNineLights}))
      << "truth on this grid " << grid.error << ", homogeneous " << homogeneous->held_out.error
      << ", noise " << grid.noise_floor;
  EXPECT_LE(result->held_out.error, 1.05 * homogeneous->held_out.error);
}

INSTANTIATE_TEST_SUITE_P(
    All,
    ExtremeSamples,
    ::testing::Values(
        ExtremeSample{"Everyday", with(everyday)},
        ExtremeSample{
            "Contrast1e6",
            with([](Vec3 p, int) -> Coefficients {
              return {std::pow(10.0, 3.0 * std::sin(2.0 * p.x) * std::cos(1.5 * p.y)), 1e-3};
            }),
            {1e-4, 1e4}},
        ExtremeSample{"NoAbsorption", with([](Vec3 p, int c) -> Coefficients {
                        return {everyday(p, c).reduced_scattering, 0.0};
                      })},
        ExtremeSample{"OpaqueVoxel", with([](Vec3 p, int c) -> Coefficients {
                        const bool inside =
                            p.x > 3 && p.x < 4 && p.y > 3 && p.y < 4 && p.z > 1 && p.z < 2;
                        return {inside ? 100.0 : 1.0 + 0.3 * c, 0.01};
                      })},
        ExtremeSample{"VeryDark", with([](Vec3 p, int c) -> Coefficients {
                        return {everyday(p, c).reduced_scattering, 1.0};
                      })},
        ExtremeSample{"OneVoxelThick", sized({8, 8, 1, 1.0, 1.0, 4.0})},
        ExtremeSample{"OneVoxelWide", sized({1, 8, 4, 1.0, 1.0, 1.0})},
        ExtremeSample{"FlatVoxels", flat(25.0)},
        ExtremeSample{"MostlyAir", flat(1.0)},
        ExtremeSample{"TallVoxels", sized({8, 8, 4, 0.05, 0.05, 5.0})},
        ExtremeSample{"MatchedIndex", of_index(1.0)},
        ExtremeSample{"IndexOfThree", of_index(3.0)}),
    [](const auto& extreme) { return std::string(extreme.param.name); });

TEST(ExtremeSample, OfOneVoxelIsAFitOfTwoNumbers) {
  SyntheticOptions one = sized({1, 1, 1, 2.0, 2.0, 2.0});
  one.regions = 1;
  one.heterogeneous = false;
  const auto solver = host::make_host_solver({.threads = 2});
  NullSink events;
  const SystemClock clock;
  const auto result =
      reconstruct_material(make_synthetic_dataset(one), {}, {*solver, events, clock}, {});
  ASSERT_TRUE(result) << result.error().message;
  expect_within_bounds(*result, {});
  // One datum a channel, and the smoothness prior has nothing to say: it is met to its noise.
  EXPECT_LE(result->fitted.error, 3.0 * 0.01);
}

// Saturated pixels are masked, here the brightest quarter of each picture: what is left says enough.
TEST(ExtremeSample, SaturatedWhereItIsBrightestIsFoundFromTheRest) {
  const Dataset whole = make_synthetic_dataset(plain());
  Dataset saturated = whole;
  for (Illumination& i : saturated.illuminations) {
    if (i.held_out) continue;
    std::vector<float> levels;
    for (std::size_t p = 0; p < i.mask.pixel_count(); ++p)
      levels.push_back(i.radiance.samples()[p * kColorChannels]);
    std::vector<float> sorted = levels;
    std::ranges::sort(sorted);
    const float full = sorted[sorted.size() * 3 / 4];
    for (std::size_t p = 0; p < levels.size(); ++p)
      if (levels[p] >= full) {
        i.mask.samples()[p] = 0;
        for (int c = 0; c < kColorChannels; ++c)
          i.radiance.samples()[p * kColorChannels + static_cast<std::size_t>(c)] = full;
      }
  }
  const auto solver = host::make_host_solver({.threads = 2});
  NullSink events;
  const SystemClock clock;
  const auto all = reconstruct_material(whole, {}, {*solver, events, clock}, {});
  const auto some = reconstruct_material(saturated, {}, {*solver, events, clock}, {});
  ASSERT_TRUE(all && some);
  // Where nothing was clipped, as good as with all of it, to twice the noise.
  EXPECT_LE(some->held_out.error, all->held_out.error + 2.0 * all->held_out.noise_floor);
}

}  // namespace
}  // namespace opaline::reconstruct
