#include "gpu/device_choice.h"

#include <gmock/gmock.h>
#include <vulkan/vulkan_core.h>

namespace opaline::gpu {
namespace {

using testing::HasSubstr;

DeviceCandidate device(std::string name, DeviceKind kind, std::uint64_t memory_bytes = 1 << 20) {
  DeviceCandidate candidate;
  candidate.info.name = std::move(name);
  candidate.info.kind = kind;
  candidate.info.api_version = VK_API_VERSION_1_3;
  candidate.info.memory_bytes = memory_bytes;
  candidate.compute_queue = true;
  candidate.graphics_queue = true;
  return candidate;
}

TEST(DeviceChoice, PrefersARealGpuToASoftwareOne) {
  const std::vector devices{device("soft", DeviceKind::kSoftware),
                            device("inside", DeviceKind::kIntegrated),
                            device("card", DeviceKind::kDiscrete)};
  EXPECT_EQ(choose_device(devices, {}).value(), 2U);
}

TEST(DeviceChoice, PrefersTheLargerOfTwoCards) {
  const std::vector devices{device("small", DeviceKind::kDiscrete, 4),
                            device("large", DeviceKind::kDiscrete, 8)};
  EXPECT_EQ(choose_device(devices, {}).value(), 1U);
}

TEST(DeviceChoice, TakesASoftwareDeviceWhenThereIsNoOtherAndItIsAllowed) {
  const std::vector devices{device("soft", DeviceKind::kSoftware)};
  EXPECT_TRUE(choose_device(devices, {}));
  const auto refused = choose_device(devices, {.allow_software = false});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.error().message, HasSubstr("soft: it is a software device"));
}

TEST(DeviceChoice, TakesTheDeviceThatIsNamed) {
  const std::vector devices{device("card one", DeviceKind::kDiscrete),
                            device("card two", DeviceKind::kDiscrete)};
  EXPECT_EQ(choose_device(devices, {.name = "two"}).value(), 1U);
}

TEST(DeviceChoice, NamesEveryDeviceAndWhyItWasRefused) {
  std::vector devices{device("old", DeviceKind::kDiscrete),
                      device("plain", DeviceKind::kDiscrete),
                      device("compute", DeviceKind::kDiscrete)};
  devices[0].info.api_version = VK_API_VERSION_1_1;
  devices[1].missing = {"timeline semaphores"};
  devices[2].graphics_queue = false;
  const auto refused = choose_device(devices, {.graphics = true});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("old: it speaks Vulkan 1.1, 1.3 is needed"));
  EXPECT_THAT(refused.error().message, HasSubstr("plain: it lacks timeline semaphores"));
  EXPECT_THAT(refused.error().message, HasSubstr("compute: it cannot draw"));
}

TEST(DeviceChoice, SaysWhenThereIsNoDevice) {
  EXPECT_THAT(choose_device({}, {}).error().message, HasSubstr("no Vulkan device"));
}

}  // namespace
}  // namespace opaline::gpu
