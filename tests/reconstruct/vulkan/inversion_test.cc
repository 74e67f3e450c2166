#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/vulkan/vulkan_solver.h"
#include "tests/support/synthetic_dataset.h"
#include "tests/support/vulkan.h"

namespace opaline::reconstruct::vulkan {
namespace {

Result<InverseResult> invert(const Dataset& dataset, diffusion::FluenceSolver& solver) {
  InverseOptions options;
  options.max_iterations = 12;
  options.tolerance = 1e-9;
  NullSink events;
  const SystemClock clock;
  return reconstruct_material(dataset, options, {solver, events, clock}, {});
}

/// The largest |log(a / b)|.
double worst_ratio(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::abs(std::log(a[i] / b[i])));
  return worst;
}

// Both run the same minimisation on solves that differ by 1e-9 of the right-hand side; twelve iterations with their line
// searches may amplify that a thousandfold and more, and the answer is still the same to a part in a thousand.
TEST(InversionOnVulkan, EndsAtTheMaterialThatTheReferenceEndsAt) {
  const Dataset dataset = testing_support::make_synthetic_dataset({{8, 8, 4, 1.0, 1.0, 1.0}, 2});
  auto vulkan = make_vulkan_solver({tests::validated()});
  ASSERT_TRUE(vulkan) << vulkan.error().message;
  const auto reference = diffusion::make_reference_solver();
  const auto on_gpu = invert(dataset, **vulkan);
  ASSERT_TRUE(on_gpu) << on_gpu.error().message;
  const auto truth = invert(dataset, *reference);
  ASSERT_TRUE(truth) << truth.error().message;
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const ChannelCoefficients& a = on_gpu->material.channels[c];
    const ChannelCoefficients& b = truth->material.channels[c];
    EXPECT_LE(worst_ratio(a.reduced_scattering, b.reduced_scattering), 1e-3) << kChannelNames[c];
    EXPECT_LE(worst_ratio(a.absorption, b.absorption), 1e-3) << kChannelNames[c];
    EXPECT_EQ(on_gpu->channels[c].history.size(), truth->channels[c].history.size());
    EXPECT_GT(on_gpu->channels[c].history.size(), 3U);  // it did go on from the homogeneous fit
  }
  EXPECT_NEAR(on_gpu->held_out.error, truth->held_out.error, 1e-4);
}

}  // namespace
}  // namespace opaline::reconstruct::vulkan
