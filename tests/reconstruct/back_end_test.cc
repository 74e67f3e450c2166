#include "reconstruct/back_end.h"

#include <gmock/gmock.h>

#include "reconstruct/fallback_solver.h"
#include "reconstruct/host/host_solver.h"
#include "tests/reconstruct/support/media.h"
#include "tests/support/vulkan.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using diffusion::testing::random_fields;
using diffusion::testing::random_medium;
using diffusion::testing::worst_difference;
using testing::HasSubstr;
using testing::StartsWith;

constexpr Block kBlock{17, 9, 8, 0.5, 0.5, 0.5};

struct Outcome {
  Result<void> result;
  std::string description;
  double difference = 0.0;  // from what the host computes
};

Outcome solve_twice(const InverseOptions& options, const gpu::ContextOptions& gpu) {
  const auto solver = make_solver(options, gpu);
  if (!solver) return {solver.error(), {}, 0.0};
  const auto medium = random_medium(kBlock, 10.0, 1);
  const FieldBatch b = random_fields(kBlock, 5, 2);
  const auto host = host::make_host_solver({.threads = 1});
  EXPECT_TRUE(host->prepare(medium));
  FieldBatch truth(b.cells, b.count);
  EXPECT_TRUE(host->solve(b, truth, {1e-9, 100}, {}));
  FieldBatch phi(b.cells, b.count);
  for (int i = 0; i < 2; ++i) {
    if (auto prepared = (*solver)->prepare(medium); !prepared) return {prepared.error(), {}, 0.0};
    const auto solved = (*solver)->solve(b, phi, {1e-9, 100}, {});
    if (!solved) return {solved.error(), {}, 0.0};
  }
  return {ok(), (*solver)->description(), worst_difference(phi, truth)};
}

InverseOptions vulkan_or(bool fallback) {
  InverseOptions options;
  options.back_end = BackEnd::kVulkan;
  options.back_end_fallback = fallback;
  options.threads = 1;
  return options;
}

// The tests' only device is a CPU in disguise: slower than the host back end.
TEST(BackEnd, AutoNeverTakesASoftwareDevice) {
  const auto solver = make_solver({}, tests::validated());
  ASSERT_TRUE(solver);
  EXPECT_THAT((*solver)->description(), StartsWith("host"));
}

TEST(BackEnd, VulkanTakesTheSoftwareDeviceWhenItIsNamed) {
  const Outcome outcome = solve_twice(vulkan_or(false), tests::validated());
  ASSERT_TRUE(outcome.result) << outcome.result.error().message;
  EXPECT_THAT(outcome.description, StartsWith("vulkan, llvmpipe"));
}

// Every place where the device can be lost or be full, from the first upload to the last read-back.
class FailingDevice : public testing::TestWithParam<gpu::Rehearsal> {
 protected:
  gpu::ContextOptions options() const {
    gpu::ContextOptions gpu = tests::validated();
    gpu.rehearsal = GetParam();
    return gpu;
  }
};

TEST_P(FailingDevice, IsAnErrorThatNamesTheRemedy) {
  const Outcome outcome = solve_twice(vulkan_or(false), options());
  ASSERT_FALSE(outcome.result);
  EXPECT_EQ(outcome.result.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(outcome.result.error().message, HasSubstr("back_end = \"host\""));
}

// Both solvers reach 1e-9 of the right-hand side; the condition of the matrix stands between that and the fluence.
TEST_P(FailingDevice, HandsOverToTheHostWhereThatIsAllowedAndSaysSo) {
  const Outcome outcome = solve_twice(vulkan_or(true), options());
  ASSERT_TRUE(outcome.result) << outcome.result.error().message;
  EXPECT_THAT(outcome.description, StartsWith("host, 1 thread"));
  EXPECT_THAT(outcome.description, HasSubstr("after vulkan, llvmpipe"));
  EXPECT_LE(outcome.difference, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Places,
                         FailingDevice,
                         testing::Values(gpu::Rehearsal{.lost_at_submission = 1},
                                         gpu::Rehearsal{.lost_at_submission = 9},
                                         gpu::Rehearsal{.lost_at_submission = 25},
                                         gpu::Rehearsal{.full_at_allocation = 1},
                                         gpu::Rehearsal{.full_at_allocation = 30},
                                         gpu::Rehearsal{.memory_bytes = 150'000}));

TEST(BackEnd, HandsOverToTheHostWhenNoDeviceWillDo) {
  gpu::ContextOptions nobody = tests::validated();
  nobody.device.name = "no such card";
  const auto refused = make_solver(vulkan_or(false), nobody);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("back_end = \"host\""));
  const auto solver = make_solver(vulkan_or(true), nobody);
  ASSERT_TRUE(solver) << solver.error().message;
  EXPECT_THAT((*solver)->description(), StartsWith("host"));
}

TEST(BackEnd, DoesNotTakeACallersMistakeForAFailedDevice) {
  const auto solver = make_solver(vulkan_or(true), tests::validated());
  ASSERT_TRUE(solver);
  auto medium = random_medium(kBlock, 10.0, 1);
  medium.diffusion[0] = -1.0;
  EXPECT_EQ((*solver)->prepare(medium).error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT((*solver)->description(), StartsWith("vulkan"));
}

}  // namespace
}  // namespace opaline::reconstruct
