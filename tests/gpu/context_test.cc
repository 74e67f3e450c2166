#include "gpu/context.h"

#include <gmock/gmock.h>

#include "gpu/commands.h"
#include "gpu/error.h"
#include "tests/support/vulkan.h"

namespace opaline::gpu {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(Context, OpensTheSoftwareDeviceWithoutAValidationMessage) {
  const auto context = Context::create(tests::validated());
  ASSERT_TRUE(context) << context.error().message;
  EXPECT_EQ((*context)->device().kind, DeviceKind::kSoftware);
  EXPECT_GE((*context)->device().max_binding_bytes, 128U << 20);
}

TEST(Context, PassesOnWhatTheValidationLayerSays) {
  int messages = 0;
  ContextOptions options = tests::validated();
  options.on_validation_message = [&](std::string_view) { ++messages; };
  const auto context = Context::create(options);
  ASSERT_TRUE(context);
  auto commands = Commands::create(**context);
  ASSERT_TRUE(commands);
  (void)commands->end();  // which nobody began
  EXPECT_GE(messages, 1);
}

TEST(Context, NamesTheDevicesItRefusesAndWhy) {
  ContextOptions options = tests::validated();
  options.device.allow_software = false;
  const auto context = Context::create(options);
  ASSERT_FALSE(context);
  EXPECT_EQ(context.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(context.error().message, HasSubstr("llvmpipe"));
  EXPECT_THAT(context.error().message, HasSubstr("software device"));
}

TEST(Context, ListsDevicesWithTheirRefusals) {
  const auto devices = list_devices({.name = "no such card"});
  ASSERT_TRUE(devices) << devices.error().message;
  ASSERT_FALSE(devices->empty());
  EXPECT_THAT(devices->front().refusal, HasSubstr("no such card"));
  const auto usable = list_devices({.graphics = true});
  ASSERT_TRUE(usable);
  EXPECT_THAT(usable->front().refusal, IsEmpty());
}

TEST(GpuError, SaysWhatTheCallerCanDo) {
  const Error lost = error_from(VK_ERROR_DEVICE_LOST, "solving");
  EXPECT_EQ(lost.code, ErrorCode::kUnavailable);
  EXPECT_THAT(lost.message, HasSubstr("solving: the GPU was lost"));
  EXPECT_EQ(error_from(VK_ERROR_OUT_OF_DEVICE_MEMORY, "x").code, ErrorCode::kUnavailable);
  EXPECT_EQ(error_from(VK_TIMEOUT, "x").code, ErrorCode::kTimeout);
  EXPECT_EQ(error_from(VK_ERROR_UNKNOWN, "x").code, ErrorCode::kInternal);
}

}  // namespace
}  // namespace opaline::gpu
