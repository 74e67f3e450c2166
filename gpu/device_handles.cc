#include "gpu/device_handles.h"

#include "base/log.h"

namespace opaline::gpu {
namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL hear(VkDebugUtilsMessageSeverityFlagBitsEXT /*severity*/,
                                    VkDebugUtilsMessageTypeFlagsEXT /*types*/,
                                    const VkDebugUtilsMessengerCallbackDataEXT* data,
                                    void* user) {
  const auto& listener = *static_cast<const ValidationListener*>(user);
  if (listener) {
    listener(data->pMessage);
  } else {
    log::error("Vulkan validation: {}", data->pMessage);
  }
  return VK_FALSE;
}

}  // namespace

vk::DebugUtilsMessengerCreateInfoEXT messenger_info(const ValidationListener& listener,
                                                    vk::DebugUtilsMessageTypeFlagsEXT types) {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  return {{},
          Severity::eWarning | Severity::eError,
          types,
          &hear,
          const_cast<ValidationListener*>(&listener)};  // Vulkan's user data is not const
}

std::optional<std::uint32_t> memory_type_of(const vk::PhysicalDeviceMemoryProperties& memory,
                                            std::uint32_t allowed,
                                            vk::MemoryPropertyFlags needed,
                                            vk::MemoryPropertyFlags liked) {
  for (const vk::MemoryPropertyFlags wanted : {needed | liked, needed})
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
      if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted)
        return i;
  return std::nullopt;
}

}  // namespace opaline::gpu
