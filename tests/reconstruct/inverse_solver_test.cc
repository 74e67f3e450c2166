#include "reconstruct/inverse_solver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reconstruct/diffusion/reference_solver.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using testing_support::make_synthetic_dataset;

Result<InverseResult> invert(const Dataset& dataset, const InverseOptions& options) {
  const auto solver = diffusion::make_reference_solver();
  NullSink events;
  const SystemClock clock;
  return reconstruct_material(dataset, options, {*solver, events, clock}, {});
}

TEST(InverseSolver, RelightsAHeterogeneousSampleUnderLightsItNeverSaw) {
  const Dataset dataset = make_synthetic_dataset({});
  const auto result = invert(dataset, {});
  ASSERT_TRUE(result) << result.error().message;
  for (const ChannelReport& channel : result->channels) {
    EXPECT_LT(channel.history.back().chi_squared_per_datum, 1.5);
  }
  EXPECT_LE(result->held_out.error, 0.04);
}

}  // namespace
}  // namespace opaline::reconstruct
