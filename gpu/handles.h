#pragma once

#include <chrono>
#include <string_view>
#include <utility>

#include "base/ensure.h"
#include "base/log.h"
#include "base/result.h"
#include "gpu/buffer.h"
#include "gpu/commands.h"
#include "gpu/context.h"
#include "gpu/device_handles.h"
#include "gpu/error.h"
#include "gpu/image.h"
#include "gpu/pipeline.h"

/// Vulkan's handles behind the classes of gpu/, each in Vulkan-Hpp's RAII types: for the .cc files
/// of gpu/ and of the viewer's window only, since <vulkan/vulkan_raii.hpp> costs seconds to compile.
namespace opaline::gpu {

/// Calls a function of Vulkan-Hpp, which throws, and turns what it throws into an Error.
template <class F>
auto guarded(std::string_view what, F&& call) -> Result<decltype(call())> {
  try {
    if constexpr (std::is_void_v<decltype(call())>) {
      call();
      return ok();
    } else {
      return call();
    }
  } catch (const vk::SystemError& e) {
    return error_from(static_cast<VkResult>(e.code().value()), what);
  } catch (const std::runtime_error& e) {  // Vulkan-Hpp's loader: libvulkan is missing
    return unavailable(std::string(what) + ": " + e.what() + "; install libvulkan1");
  }
}

struct Context::Handles : DeviceHandles {
  vk::raii::Semaphore timeline = nullptr;
  vk::PhysicalDeviceMemoryProperties memory;
  std::uint32_t queue_family = 0;
  std::uint64_t submitted = 0;        ///< the timeline's value when all is done
  std::uint64_t allocated_bytes = 0;  ///< of all buffers
  int allocations = 0;
  Traffic traffic;
  bool lost = false;  ///< a deadline passed or the device is gone
  DeviceInfo info;
  ContextOptions options;

  /// Whether the device may still use what was submitted: then nothing of it may be destroyed.
  bool busy() const;
  /// As memory_type_of(). Errors: kUnavailable where there is none.
  Result<std::uint32_t> memory_type(std::uint32_t allowed,
                                    vk::MemoryPropertyFlags needed,
                                    vk::MemoryPropertyFlags liked) const;
};

/// Destroys handles, unless the device hangs on to them: what a hung GPU may still use is leaked,
/// and said so.
template <class... Handle>
void release_if_busy(const Context::Handles& context, Handle&... handles) {
  if (!context.lost || !context.busy()) return;
  log::error("the GPU never finished its work: {} of its objects are leaked", sizeof...(handles));
  (handles.release(), ...);
}

struct Buffer::Handles {
  Context::Handles* context = nullptr;
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::Buffer buffer = nullptr;
  std::uint64_t bytes = 0;
  std::uint64_t allocated_bytes = 0;
  std::byte* mapped = nullptr;
  ~Handles() {
    context->allocated_bytes -= allocated_bytes;
    release_if_busy(*context, buffer, memory);
  }
};

struct RenderTarget::Handles {
  Context::Handles* context = nullptr;
  vk::raii::DeviceMemory color_memory = nullptr;
  vk::raii::DeviceMemory depth_memory = nullptr;
  vk::raii::Image color = nullptr;
  vk::raii::Image depth = nullptr;
  vk::raii::ImageView color_view = nullptr;
  vk::raii::ImageView depth_view = nullptr;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  ~Handles() {
    release_if_busy(*context, color_view, depth_view, color, depth, color_memory, depth_memory);
  }
};

inline constexpr vk::Format kColorFormat = vk::Format::eR32G32B32A32Sfloat;
inline constexpr vk::Format kDepthFormat = vk::Format::eD32Sfloat;

inline vk::DescriptorType buffer_type(const Interface& interface, std::uint32_t binding) {
  return binding < interface.uniforms ? vk::DescriptorType::eUniformBuffer
                                      : vk::DescriptorType::eStorageBuffer;
}

struct Pipeline::Handles {
  Context::Handles* context = nullptr;
  vk::raii::DescriptorSetLayout set_layout = nullptr;
  vk::raii::PipelineLayout layout = nullptr;
  vk::raii::Pipeline pipeline = nullptr;
  Interface interface;
  vk::ShaderStageFlags stages;
  ~Handles() { release_if_busy(*context, pipeline, layout, set_layout); }
};

struct Commands::Handles {
  Context::Handles* context = nullptr;
  vk::raii::CommandPool pool = nullptr;
  vk::raii::CommandBuffer commands = nullptr;
  ~Handles() { release_if_busy(*context, commands, pool); }
};

}  // namespace opaline::gpu
