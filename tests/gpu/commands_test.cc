#include "gpu/commands.h"

#include <gmock/gmock.h>

#include <numeric>
#include <vector>

#include "gpu/context.h"
#include "gpu_test_shaders.h"
#include "tests/support/vulkan.h"

namespace opaline::gpu {
namespace {

using testing::HasSubstr;

class CommandsTest : public testing::Test {
 protected:
  void SetUp() override {
    ContextOptions options = tests::validated();
    options.device.graphics = true;
    auto context = Context::create(options);
    ASSERT_TRUE(context) << context.error().message;
    context_ = *std::move(context);
  }
  Buffer buffer_of(const std::vector<float>& values) {
    auto buffer = Buffer::create(*context_, values.size() * sizeof(float), Memory::kDevice);
    EXPECT_TRUE(buffer && upload(*context_, std::as_bytes(std::span(values)), *buffer));
    return *std::move(buffer);
  }
  std::vector<float> read(const Buffer& buffer) {
    std::vector<float> values(buffer.bytes() / sizeof(float));
    EXPECT_TRUE(download(*context_, buffer, std::as_writable_bytes(std::span(values))));
    return values;
  }
  std::unique_ptr<Context> context_;
};

struct ScaleAdd {
  std::uint32_t n;
  float a;
};

TEST_F(CommandsTest, RunsAKernelTwiceWithABarrierBetween) {
  std::vector<float> x(1000);
  std::iota(x.begin(), x.end(), 0.0F);
  const Buffer gpu_x = buffer_of(x);
  const Buffer gpu_y = buffer_of(std::vector<float>(x.size(), 1.0F));
  const auto kernel = Pipeline::create_compute(
      *context_, "scale_add", shaders::scale_add_comp, {2, sizeof(ScaleAdd)});
  ASSERT_TRUE(kernel) << kernel.error().message;
  auto commands = Commands::create(*context_);
  ASSERT_TRUE(commands && commands->begin());
  for (const float a : {2.0F, 0.5F}) {
    const ScaleAdd push{static_cast<std::uint32_t>(x.size()), a};
    commands->dispatch(*kernel, {{{&gpu_x, &gpu_y}}, push_of(push)}, {8, 1, 1});
    commands->barrier();
  }
  ASSERT_TRUE(commands->end());
  ASSERT_TRUE(context_->run(*commands));
  ASSERT_TRUE(context_->run(*commands));  // the same list again
  const std::vector<float> y = read(gpu_y);
  for (std::size_t i = 0; i < y.size(); ++i) ASSERT_EQ(y[i], 1.0F + 5.0F * x[i]) << i;
}

TEST_F(CommandsTest, CopiesAndClearsBuffers) {
  Buffer a = buffer_of({1, 2, 3, 4});
  Buffer b = buffer_of({0, 0, 0, 0});
  auto commands = Commands::create(*context_);
  ASSERT_TRUE(commands && commands->begin());
  commands->copy(a, b, 3 * sizeof(float));
  commands->barrier();
  commands->fill_zero(a);
  commands->barrier();
  ASSERT_TRUE(commands->end() && context_->run(*commands));
  EXPECT_EQ(read(a), std::vector<float>(4, 0.0F));
  EXPECT_EQ(read(b), (std::vector<float>{1, 2, 3, 0}));
}

TEST_F(CommandsTest, DrawsTheNearerTriangleOverABlackBackground) {
  const Buffer colors = buffer_of({1, 2, 3, 1, 7, 8, 9, 1});
  const auto pipeline = Pipeline::create_raster(
      *context_, "layers", shaders::layers_vert, shaders::layers_frag, {1, 0});
  ASSERT_TRUE(pipeline) << pipeline.error().message;
  auto target = RenderTarget::create(*context_, 6, 4);
  ASSERT_TRUE(target) << target.error().message;
  auto picture = Buffer::create(*context_, target->color_bytes(), Memory::kHost);
  auto commands = Commands::create(*context_);
  ASSERT_TRUE(picture && commands && commands->begin());
  commands->draw(*pipeline, {{{&colors}}, {}}, 6, *target);
  commands->copy_color(*target, *picture);
  commands->barrier();
  ASSERT_TRUE(commands->end() && context_->run(*commands));
  const auto pixel = [&](int x, int y) { return picture->floats()[4 * (6 * y + x) + 1]; };
  EXPECT_EQ(pixel(0, 3),
            2.0F);  // inside: the near layer's green, though the far one was drawn last
  EXPECT_EQ(pixel(5, 0), 0.0F);  // outside
}

TEST_F(CommandsTest, RefusesABufferThatNoBindingCouldSee) {
  const std::uint64_t most = context_->device().max_binding_bytes;
  const auto buffer = Buffer::create(*context_, most + 1, Memory::kDevice);
  ASSERT_FALSE(buffer);
  EXPECT_EQ(buffer.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(buffer.error().message, HasSubstr(std::to_string(most)));
}

// Two kernels in a row that write and read the same buffer: what orders them on a real device is the barrier alone.
TEST_F(CommandsTest, HearsFromTheValidationLayerOfABarrierThatIsMissing) {
  int hazards = 0;
  ContextOptions options = tests::validated();
  options.on_validation_message = [&](std::string_view message) {
    hazards += message.find("SYNC-HAZARD") != std::string_view::npos ? 1 : 0;
  };
  const auto context = Context::create(options);
  ASSERT_TRUE(context) << context.error().message;
  const auto kernel = Pipeline::create_compute(
      **context, "scale_add", shaders::scale_add_comp, {2, sizeof(ScaleAdd)});
  auto x = Buffer::create(**context, 400, Memory::kDevice);
  auto y = Buffer::create(**context, 400, Memory::kDevice);
  auto commands = Commands::create(**context);
  ASSERT_TRUE(kernel && x && y && commands && commands->begin());
  commands->fill_zero(*x);
  commands->fill_zero(*y);
  commands->barrier();
  const ScaleAdd push{100, 1.0F};
  commands->dispatch(*kernel, {{{&*x, &*y}}, push_of(push)}, {1, 1, 1});
  commands->dispatch(*kernel, {{{&*y, &*x}}, push_of(push)}, {1, 1, 1});
  ASSERT_TRUE(commands->end());
  EXPECT_GE(hazards, 1);
}

TEST_F(CommandsTest, LosesItsDeviceOnCueAndIsLostFromThenOn) {
  ContextOptions options = tests::validated();
  options.rehearsal.lost_at_submission = 2;
  const auto context = Context::create(options);
  ASSERT_TRUE(context) << context.error().message;
  auto commands = Commands::create(**context);
  ASSERT_TRUE(commands && commands->begin() && commands->end());
  EXPECT_TRUE((*context)->run(*commands));
  const auto second = (*context)->run(*commands);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(second.error().message, HasSubstr("the GPU was lost"));
  EXPECT_THAT((*context)->run(*commands).error().message, HasSubstr("was lost earlier"));
}

TEST_F(CommandsTest, KeepsItsBuffersWithinTheDevicesMemoryAndGivesBackWhatTheyHeld) {
  ContextOptions options = tests::validated();
  options.rehearsal.memory_bytes = 4 << 20;
  options.rehearsal.full_at_allocation = 3;
  const auto context = Context::create(options);
  ASSERT_TRUE(context) << context.error().message;
  const std::uint64_t whole = (*context)->memory_left();
  {
    const auto held = Buffer::create(**context, 3 << 20, Memory::kDevice);
    ASSERT_TRUE(held);
    EXPECT_LE((*context)->memory_left(), whole - (3 << 20));
    const auto refused = Buffer::create(**context, 2 << 20, Memory::kDevice);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(refused.error().message, HasSubstr("out of GPU memory"));
  }
  EXPECT_EQ((*context)->memory_left(), whole);
  EXPECT_FALSE(Buffer::create(**context, 16, Memory::kDevice));  // the third: on cue
  EXPECT_TRUE(Buffer::create(**context, 16, Memory::kDevice));
}

TEST_F(CommandsTest, RefusesARenderTargetLargerThanTheDeviceDraws) {
  const auto target = RenderTarget::create(*context_, context_->device().max_image_side + 1, 1);
  ASSERT_FALSE(target);
  EXPECT_EQ(target.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(CommandsTest, AnswersTimeoutWhenTheDeadlinePassesAndIsLostFromThenOn) {
  const Buffer state = buffer_of({0});
  const auto kernel = Pipeline::create_compute(*context_, "spin", shaders::spin_comp, {1, 4});
  auto commands = Commands::create(*context_);
  ASSERT_TRUE(kernel && commands && commands->begin());
  const std::uint32_t rounds = 50'000'000;  // about 0.1 s
  commands->dispatch(*kernel, {{{&state}}, push_of(rounds)}, {1, 1, 1});
  ASSERT_TRUE(commands->end());
  const auto point = context_->submit(*commands);
  ASSERT_TRUE(point);
  const auto waited = context_->wait(*point, std::chrono::nanoseconds(1));
  ASSERT_FALSE(waited);
  EXPECT_EQ(waited.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(context_->run(*commands).error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(context_->wait(*point, std::chrono::seconds(60)));  // so that all can be destroyed
}

}  // namespace
}  // namespace opaline::gpu
