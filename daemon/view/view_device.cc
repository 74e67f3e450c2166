#include "daemon/view/view_device.h"

#include <fmt/format.h>

#include <array>

namespace opaline::daemon {
namespace {

std::string glfw_problem() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown";
}

}  // namespace

void ViewDevice::open_window() {
  if (glfwInit() != GLFW_TRUE) {
    throw std::runtime_error(fmt::format("no display ({}); is DISPLAY set?", glfw_problem()));
  }
  if (glfwVulkanSupported() != GLFW_TRUE) {
    throw std::runtime_error("GLFW finds no Vulkan; install libvulkan1 and a driver");
  }
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  window = glfwCreateWindow(options.width, options.height, options.title.c_str(), nullptr, nullptr);
  if (window == nullptr) throw std::runtime_error(glfw_problem());
  glfwSetWindowUserPointer(window, this);
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int, int) {
    static_cast<ViewDevice*>(glfwGetWindowUserPointer(w))->resized = true;
  });
}

void ViewDevice::create_instance() {
  std::uint32_t count = 0;
  const char** const needed = glfwGetRequiredInstanceExtensions(&count);
  std::vector<const char*> extensions(needed, needed + count);
  std::vector<const char*> layers;
  if (options.validation) {
    layers.push_back(gpu::kValidationLayer);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  const vk::ApplicationInfo application("opaline-view", 1, "opaline", 1, VK_API_VERSION_1_1);
  instance = vk::raii::Instance(loader, {{}, &application, layers, extensions});
  if (options.validation) {
    using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
    messenger = vk::raii::DebugUtilsMessengerEXT(
        instance,
        gpu::messenger_info(options.on_validation_message, Type::eValidation | Type::eGeneral));
  }
  VkSurfaceKHR made = VK_NULL_HANDLE;
  if (glfwCreateWindowSurface(*instance, window, nullptr, &made) != VK_SUCCESS) {
    throw std::runtime_error(glfw_problem());
  }
  surface = vk::raii::SurfaceKHR(instance, made);
}

void ViewDevice::choose_device() {
  int best = -1;
  std::string seen;
  for (vk::raii::PhysicalDevice& candidate : vk::raii::PhysicalDevices(instance)) {
    const auto properties = candidate.getProperties();
    const std::string name = properties.deviceName.data();
    seen += (seen.empty() ? "" : ", ") + name;
    const auto families = candidate.getQueueFamilyProperties();
    for (std::uint32_t f = 0; f < families.size(); ++f) {
      if (!(families[f].queueFlags & vk::QueueFlagBits::eGraphics) ||
          candidate.getSurfaceSupportKHR(f, *surface) == VK_FALSE ||
          name.find(options.device) == std::string::npos) {
        continue;
      }
      const int rank = properties.deviceType == vk::PhysicalDeviceType::eDiscreteGpu     ? 3
                       : properties.deviceType == vk::PhysicalDeviceType::eIntegratedGpu ? 2
                       : properties.deviceType == vk::PhysicalDeviceType::eCpu           ? 0
                                                                                         : 1;
      if (rank <= best) continue;
      best = rank;
      physical = candidate;
      family = f;
    }
  }
  if (best < 0) {
    throw std::runtime_error(
        fmt::format("no device \"{}\" that shows pictures in this window; there are: {}",
                    options.device,
                    seen));
  }
}

void ViewDevice::create_device() {
  const float priority = 1.0F;
  const vk::DeviceQueueCreateInfo queues({}, family, 1, &priority);
  static constexpr std::array extensions{VK_KHR_SWAPCHAIN_EXTENSION_NAME};
  device = vk::raii::Device(physical, vk::DeviceCreateInfo({}, queues, {}, extensions));
  queue = device.getQueue(family, 0);
  pool =
      vk::raii::CommandPool(device, {vk::CommandPoolCreateFlagBits::eResetCommandBuffer, family});
  commands = std::move(
      vk::raii::CommandBuffers(device, {*pool, vk::CommandBufferLevel::ePrimary, 1}).front());
  done = vk::raii::Fence(device, vk::FenceCreateInfo());
  acquired = vk::raii::Semaphore(device, vk::SemaphoreCreateInfo());
  const vk::DescriptorPoolSize size(vk::DescriptorType::eCombinedImageSampler, 8);
  descriptors = vk::raii::DescriptorPool(
      device, {vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 8, size});
}

void ViewDevice::run_once() {
  commands.end();
  const vk::CommandBuffer recorded = *commands;
  queue.submit(vk::SubmitInfo({}, {}, recorded), *done);
  if (device.waitForFences(*done, VK_TRUE, kAnswerNanoseconds) != vk::Result::eSuccess) {
    throw std::runtime_error("the device does not answer");
  }
  device.resetFences(*done);
}

std::uint32_t ViewDevice::memory_type(std::uint32_t allowed, vk::MemoryPropertyFlags needed) const {
  const auto type = gpu::memory_type_of(physical.getMemoryProperties(), allowed, needed);
  if (type) return *type;
  throw std::runtime_error("the device has no memory of the kind needed");
}

void ViewDevice::make_staging(vk::DeviceSize bytes) {
  if (staging.bytes >= bytes) return;
  staging = {};
  using Usage = vk::BufferUsageFlagBits;
  staging.buffer = vk::raii::Buffer(device, {{}, bytes, Usage::eTransferSrc | Usage::eTransferDst});
  const auto needs = staging.buffer.getMemoryRequirements();
  using Property = vk::MemoryPropertyFlagBits;
  staging.memory = vk::raii::DeviceMemory(
      device,
      {needs.size,
       memory_type(needs.memoryTypeBits, Property::eHostVisible | Property::eHostCoherent)});
  staging.buffer.bindMemory(*staging.memory, 0);
  staging.mapped = staging.memory.mapMemory(0, bytes);
  staging.bytes = bytes;
}

void ViewDevice::make_picture(vk::Extent2D size) {
  if (picture_extent == size) return;
  picture = {};
  using Usage = vk::ImageUsageFlagBits;
  picture.image = vk::raii::Image(device,
                                  {{},
                                   vk::ImageType::e2D,
                                   vk::Format::eR8G8B8A8Unorm,
                                   {size.width, size.height, 1},
                                   1,
                                   1,
                                   vk::SampleCountFlagBits::e1,
                                   vk::ImageTiling::eOptimal,
                                   Usage::eTransferDst | Usage::eTransferSrc});
  const auto needs = picture.image.getMemoryRequirements();
  picture.memory =
      vk::raii::DeviceMemory(device, {needs.size, memory_type(needs.memoryTypeBits, {})});
  picture.image.bindMemory(*picture.memory, 0);
  picture_extent = size;
}

}  // namespace opaline::daemon
