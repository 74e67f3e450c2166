#include "reconstruct/vulkan/vulkan_solver.h"

#include <gmock/gmock.h>

#include "reconstruct/diffusion/conjugate_gradient.h"
#include "reconstruct/diffusion/reference_passes.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/vulkan/vulkan_passes.h"
#include "tests/reconstruct/support/solver_truths.h"
#include "tests/support/vulkan.h"

namespace opaline::reconstruct::vulkan {
namespace {

using diffusion::FieldBatch;
using diffusion::FluenceSolver;
using diffusion::Medium;
using diffusion::SolveSummary;
using diffusion::testing::random_fields;
using diffusion::testing::random_medium;
using diffusion::testing::worst_difference;
using testing::HasSubstr;

std::unique_ptr<FluenceSolver> make() {
  auto solver = make_vulkan_solver({tests::validated()});
  EXPECT_TRUE(solver) << solver.error().message;
  return solver ? *std::move(solver) : nullptr;
}

struct Validated {
  static std::unique_ptr<FluenceSolver> make() { return vulkan::make(); }
};

FieldBatch solve(FluenceSolver& solver, const Medium& medium, const FieldBatch& b) {
  EXPECT_TRUE(solver.prepare(medium));
  FieldBatch phi(b.cells, b.count);
  const Result<SolveSummary> solved = solver.solve(b, phi, {1e-8, 100}, {});
  EXPECT_TRUE(solved && solved->termination == diffusion::Termination::kConverged);
  return phi;
}

TEST(VulkanSolver, AgreesWithReferenceAndHost) {
  const auto vulkan = make();
  const auto reference = diffusion::make_reference_solver();
  const auto host = host::make_host_solver({.threads = 2});
  const std::vector<std::pair<Block, int>> cases{{{1, 1, 1, 0.5, 0.5, 0.5}, 1},
                                                 {{17, 33, 5, 0.5, 0.4, 0.3}, 5},
                                                 {{64, 64, 32, 0.5, 0.5, 0.5}, 2},
                                                 {{2, 300, 2, 0.5, 0.5, 0.5}, 9},
                                                 {{5, 3, 41, 0.5, 0.5, 0.1}, 16}};
  for (const auto& [block, count] : cases) {
    const Medium medium = random_medium(block, 30.0, 4);
    const FieldBatch b = random_fields(block, count, 5);
    const FieldBatch phi = solve(*vulkan, medium, b);
    const FieldBatch truth = solve(*reference, medium, b);
    EXPECT_LE(worst_difference(phi, truth), 1e-5) << block.nx << "x" << block.ny << "x" << block.nz;
    EXPECT_LE(worst_difference(phi, solve(*host, medium, b)), 1e-5)
        << block.nx << "x" << block.ny << "x" << block.nz;
  }
}

/// The passes of one iteration and a half, on the device and as plain loops.
class VulkanPassesTest : public testing::TestWithParam<Block> {};

TEST_P(VulkanPassesTest, ComputeWhatTheReferenceComputes) {
  const Block block = GetParam();
  const int count = 6;
  const Medium medium = random_medium(block, 30.0, 4);
  const FieldBatch b = random_fields(block, count, 5);
  const auto levels = diffusion::build_levels(medium);
  auto context = gpu::Context::create(tests::validated());
  ASSERT_TRUE(context);
  auto kernels = Kernels::create(**context);
  auto commands = gpu::Commands::create(**context);
  auto fields = DeviceFields::create(**context, levels, 2, Staging::kField);
  ASSERT_TRUE(kernels && commands && fields);
  std::vector<DeviceLevel> coefficients;
  for (const auto& level : levels) {
    auto sent = DeviceLevel::create(**context, level);
    ASSERT_TRUE(sent);
    coefficients.push_back(*std::move(sent));
  }
  FieldBatch x(b.cells, count);
  FieldBatch x_reference(b.cells, count);
  VulkanPasses passes(
      {**context, *kernels, levels, coefficients, *fields, *commands}, b, x, 0, count);
  diffusion::ReferencePasses reference(levels, b, x_reference);
  // float32 rounding of 6e-8, amplified by what cancels: a residual falls tenfold an iteration, and what the smoother
  // leaves of it for the next level tenfold again
  const auto same = [&](const gpu::Buffer& field, FieldBatch& truth, const char* name) {
    FieldBatch read(truth.cells, truth.count);
    for (int m = 0; m < count; ++m) std::ranges::copy(passes.read(field, m), read.field(m));
    EXPECT_LE(worst_difference(read, truth), 1e-4) << name;
  };
  passes.true_residual();
  reference.true_residual();
  for (bool restart = true; const int iteration : {1, 2}) {
    same(fields->r[0], reference.r(0), "r");
    diffusion::v_cycle(passes);
    diffusion::v_cycle(reference);
    for (std::size_t l = 1; l < levels.size(); ++l)
      same(fields->r[l], reference.r(static_cast<int>(l)), "coarse r");
    same(fields->z[0], reference.z(0), "z");
    passes.apply_dot(restart);
    reference.apply_dot(restart);
    const auto norms = passes.update_norm();
    const auto truths = reference.update_norm();
    for (int m = 0; m < count; ++m) EXPECT_NEAR(norms[m] / truths[m], 1.0, 1e-4) << iteration;
    ASSERT_FALSE(passes.error());
    restart = false;
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes,
                         VulkanPassesTest,
                         testing::Values(Block{17, 33, 5, 0.5, 0.4, 0.3},
                                         Block{16, 8, 12, 0.5, 0.5, 2.0},
                                         Block{1, 130, 3, 0.5, 0.5, 0.5}));

TEST(VulkanSolver, SolvesInTurnsWhatOneBindingDoesNotHold) {
  gpu::DeviceInfo device;
  device.max_binding_bytes = 1 << 20;
  device.max_allocation_bytes = 1 << 30;
  device.memory_bytes = 1 << 30;
  device.max_groups_x = 65535;
  EXPECT_EQ(groups_that_fit(device, 1000), 65);  // 16 bytes a cell and group of four
  EXPECT_EQ(groups_that_fit(device, 65536), 1);  // exactly one
  EXPECT_EQ(groups_that_fit(device, 65537), 0);  // not even one
  device.memory_bytes = 1 << 20;
  EXPECT_EQ(groups_that_fit(device, 1000), 7);  // memory is what is short
  device.memory_bytes = 1 << 10;
  EXPECT_EQ(groups_that_fit(device, 1000), 0);
}

// Nine right-hand sides, four to a group: in one turn, in three by the binding, in three by the memory. A turn stops when
// all of its own have converged, to 1e-8.
TEST(VulkanSolver, IsTheSameInTurnsAsAtOnce) {
  const Block block{17, 33, 5, 0.5, 0.4, 0.3};
  const std::uint64_t field = 16 * block.cell_count();
  const Medium medium = random_medium(block, 30.0, 4);
  const FieldBatch b = random_fields(block, 9, 5);
  const FieldBatch at_once = solve(*make(), medium, b);
  for (const gpu::Rehearsal& small :
       {gpu::Rehearsal{.max_binding_bytes = field}, gpu::Rehearsal{.memory_bytes = 13 * field}}) {
    VulkanOptions options{tests::validated()};
    options.gpu.rehearsal = small;
    auto solver = make_vulkan_solver(options);
    ASSERT_TRUE(solver) << solver.error().message;
    EXPECT_LE(worst_difference(solve(**solver, medium, b), at_once), 1e-6);
  }
}

TEST(VulkanSolver, RefusesABlockThatTheDeviceCannotHoldAndSaysWhatElseThereIs) {
  const auto vulkan = make();
  const Block block{1024, 1024, 9, 0.5, 0.5, 0.5};  // 144 MiB a field of four; lavapipe binds 128
  const Medium medium{block,
                      std::vector<double>(block.cell_count(), 0.3),
                      std::vector<double>(block.cell_count(), 0.01),
                      2.0};
  const auto prepared = vulkan->prepare(medium);
  ASSERT_FALSE(prepared);
  EXPECT_EQ(prepared.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(prepared.error().message, HasSubstr("back_end = \"host\""));
}

TEST(VulkanSolver, SaysWhyThereIsNoDeviceAndWhatElseThereIs) {
  VulkanOptions options{tests::validated()};
  options.gpu.device.allow_software = false;
  const auto solver = make_vulkan_solver(options);
  ASSERT_FALSE(solver);
  EXPECT_EQ(solver.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(solver.error().message, HasSubstr("llvmpipe"));
  EXPECT_THAT(solver.error().message, HasSubstr("back_end = \"host\""));
  EXPECT_FALSE(real_gpu_available());
}

TEST(VulkanSolver, AnswersATimeoutWhenTheDeviceTakesTooLongAndServesNoLonger) {
  VulkanOptions options;  // without validation, which would complain of what a hung device keeps
  options.gpu.validation = false;
  options.gpu.deadline = std::chrono::milliseconds(1);
  const Block block{64, 64, 64, 0.5, 0.5, 0.5};
  auto solver = make_vulkan_solver(options);
  ASSERT_TRUE(solver);
  const FieldBatch b = random_fields(block, 4, 5);
  FieldBatch phi(b.cells, b.count);
  const auto prepared = (*solver)->prepare(random_medium(block, 30.0, 4));
  const Error error = prepared ? (*solver)->solve(b, phi, {}, {}).error() : prepared.error();
  EXPECT_EQ(error.code, ErrorCode::kTimeout);
  EXPECT_THAT(error.message, HasSubstr("back_end = \"host\""));
  EXPECT_EQ((*solver)->prepare(random_medium(block, 30.0, 4)).error().code,
            ErrorCode::kUnavailable);
}

}  // namespace
}  // namespace opaline::reconstruct::vulkan

namespace opaline::reconstruct::diffusion::testing {
using opaline::reconstruct::vulkan::Validated;
INSTANTIATE_TYPED_TEST_SUITE_P(Vulkan, SolverTruths, Validated);
}  // namespace opaline::reconstruct::diffusion::testing
