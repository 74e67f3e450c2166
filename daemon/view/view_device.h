#pragma once

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include "daemon/view/view_window.h"
#include "gpu/device_handles.h"

/// Parts of ViewWindow, for its sources only: <vulkan/vulkan_raii.hpp> costs seconds to compile. Functions throw as Vulkan-Hpp
/// does.
namespace opaline::daemon {

inline constexpr std::uint64_t kAnswerNanoseconds = 10'000'000'000;

/// An image of the device's with its memory.
struct OwnImage {
  vk::raii::Image image = nullptr;
  vk::raii::DeviceMemory memory = nullptr;
};
struct OwnBuffer {
  vk::raii::Buffer buffer = nullptr;
  vk::raii::DeviceMemory memory = nullptr;
  void* mapped = nullptr;
  vk::DeviceSize bytes = 0;
};

/// A window, the device that presents in it, and what pictures go through on their way.
struct ViewDevice : gpu::DeviceHandles {
  ViewWindowOptions options;
  GLFWwindow* window = nullptr;
  vk::raii::SurfaceKHR surface = nullptr;
  std::uint32_t family = 0;
  vk::raii::CommandPool pool = nullptr;
  vk::raii::CommandBuffer commands = nullptr;
  vk::raii::DescriptorPool descriptors = nullptr;
  vk::raii::Fence done = nullptr;
  vk::raii::Semaphore acquired = nullptr;
  OwnImage picture;
  vk::Extent2D picture_extent;
  OwnBuffer staging;
  bool resized = true;  // the swapchain is of another size

  void open_window();
  void create_instance();
  void choose_device();
  void create_device();
  /// Runs what was recorded, and waits.
  void run_once();
  std::uint32_t memory_type(std::uint32_t allowed, vk::MemoryPropertyFlags needed) const;
  void make_staging(vk::DeviceSize bytes);
  void make_picture(vk::Extent2D size);
};

/// The images that the window shows in turn; none while it has no size.
struct ViewSwapchain {
  vk::SurfaceFormatKHR format;
  vk::raii::RenderPass pass = nullptr;  // of the user interface, over a picture
  vk::raii::SwapchainKHR swapchain = nullptr;
  vk::Extent2D extent;
  std::vector<vk::Image> images;
  std::vector<vk::raii::ImageView> views;
  std::vector<vk::raii::Framebuffer> framebuffers;
  std::vector<vk::raii::Semaphore> rendered;

  void create_pass(const ViewDevice& of);
  void create_swapchain(ViewDevice& of);
};

}  // namespace opaline::daemon
