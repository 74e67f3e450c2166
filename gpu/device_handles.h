#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vulkan/vulkan_raii.hpp>

/// What a context and a window both hold of Vulkan; for the .cc files of gpu/ and of the viewer's window only, since
/// <vulkan/vulkan_raii.hpp> costs seconds to compile.
namespace opaline::gpu {

/// A device and what it hangs from, in the order they depend on each other.
struct DeviceHandles {
  vk::raii::Context loader;
  vk::raii::Instance instance = nullptr;
  vk::raii::DebugUtilsMessengerEXT messenger = nullptr;
  vk::raii::PhysicalDevice physical = nullptr;
  vk::raii::Device device = nullptr;
  vk::raii::Queue queue = nullptr;
};

inline constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

/// Sends the validation layer's warnings and errors to `listener`, which must outlive the messenger; while that is empty, to
/// the log.
using ValidationListener = std::function<void(std::string_view)>;
vk::DebugUtilsMessengerCreateInfoEXT messenger_info(const ValidationListener& listener,
                                                    vk::DebugUtilsMessageTypeFlagsEXT types);

/// The first memory type that has all of `needed` and, if there is one, also `liked`.
std::optional<std::uint32_t> memory_type_of(const vk::PhysicalDeviceMemoryProperties& memory,
                                            std::uint32_t allowed,
                                            vk::MemoryPropertyFlags needed,
                                            vk::MemoryPropertyFlags liked = {});

}  // namespace opaline::gpu
