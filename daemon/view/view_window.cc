#include "daemon/view/view_window.h"

#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "base/log.h"

namespace opaline::daemon {
namespace {

constexpr std::uint64_t kAnswerNanoseconds = 10'000'000'000;
constexpr const char* kValidation = "VK_LAYER_KHRONOS_validation";

template <class Work>
auto presenting(std::string_view what, Work&& work) -> Result<decltype(work())> {
  try {
    return work();
  } catch (const vk::SystemError& e) {
    return unavailable(fmt::format("{}: {}", what, e.what()));
  } catch (const std::runtime_error& e) {
    return unavailable(fmt::format("{}: {}", what, e.what()));
  }
}

std::string glfw_problem() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown";
}

VKAPI_ATTR VkBool32 VKAPI_CALL hear(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                    VkDebugUtilsMessageTypeFlagsEXT,
                                    const VkDebugUtilsMessengerCallbackDataEXT* data,
                                    void* user) {
  const auto& options = *static_cast<const ViewWindowOptions*>(user);
  if (options.on_validation_message) {
    options.on_validation_message(data->pMessage);
  } else {
    log::warning("Vulkan: {}", data->pMessage);
  }
  return VK_FALSE;
}

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

vk::ImageMemoryBarrier moved(vk::Image image,
                             vk::ImageLayout from,
                             vk::ImageLayout to,
                             vk::AccessFlags before,
                             vk::AccessFlags after) {
  return {before,
          after,
          from,
          to,
          VK_QUEUE_FAMILY_IGNORED,
          VK_QUEUE_FAMILY_IGNORED,
          image,
          {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1}};
}

constexpr vk::ImageSubresourceLayers kColour{vk::ImageAspectFlagBits::eColor, 0, 0, 1};

}  // namespace

struct ViewWindow::State {
  ViewWindowOptions options;
  GLFWwindow* window = nullptr;
  vk::raii::Context loader;
  vk::raii::Instance instance = nullptr;
  vk::raii::DebugUtilsMessengerEXT messenger = nullptr;
  vk::raii::SurfaceKHR surface = nullptr;
  vk::raii::PhysicalDevice physical = nullptr;
  vk::raii::Device device = nullptr;
  vk::raii::Queue queue = nullptr;
  std::uint32_t family = 0;
  vk::raii::CommandPool pool = nullptr;
  vk::raii::CommandBuffer commands = nullptr;
  vk::raii::DescriptorPool descriptors = nullptr;
  vk::raii::RenderPass pass = nullptr;
  vk::raii::Fence done = nullptr;
  vk::raii::Semaphore acquired = nullptr;
  vk::SurfaceFormatKHR format;
  vk::raii::SwapchainKHR swapchain = nullptr;
  vk::Extent2D extent;
  std::vector<vk::Image> images;
  std::vector<vk::raii::ImageView> views;
  std::vector<vk::raii::Framebuffer> framebuffers;
  std::vector<vk::raii::Semaphore> rendered;
  OwnImage picture;
  vk::Extent2D picture_extent;
  OwnBuffer staging;
  bool imgui = false;
  bool resized = true;

  ~State();
  void open_window();
  void create_instance();
  void choose_device();
  void create_device();
  void create_pass();
  void start_imgui();
  void create_swapchain();
  std::uint32_t memory_type(std::uint32_t allowed, vk::MemoryPropertyFlags needed) const;
  void make_staging(vk::DeviceSize bytes);
  void make_picture(vk::Extent2D size);
  void record(std::uint32_t index, const Image<std::uint8_t>& shown, bool keep);
  void record_keeping(vk::Image image);
  void run_once();
  bool show(const Image<std::uint8_t>& shown, Image<std::uint8_t>* seen);
  void read(Image<std::uint8_t>& seen) const;
};

ViewWindow::State::~State() {
  try {
    if (*device) device.waitIdle();
  } catch (const std::exception& e) {
    log::warning("closing the window: {}", e.what());
  }
  if (imgui) {
    ImGui_ImplVulkan_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  framebuffers.clear();
  views.clear();
  swapchain.clear();
  surface.clear();
  if (window != nullptr) glfwDestroyWindow(window);
  glfwTerminate();
}

void ViewWindow::State::open_window() {
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
    static_cast<State*>(glfwGetWindowUserPointer(w))->resized = true;
  });
}

void ViewWindow::State::create_instance() {
  std::uint32_t count = 0;
  const char** const needed = glfwGetRequiredInstanceExtensions(&count);
  std::vector<const char*> extensions(needed, needed + count);
  std::vector<const char*> layers;
  if (options.validation) {
    layers.push_back(kValidation);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  const vk::ApplicationInfo application("opaline-view", 1, "opaline", 1, VK_API_VERSION_1_1);
  instance = vk::raii::Instance(loader, {{}, &application, layers, extensions});
  if (options.validation) {
    using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
    using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
    messenger = vk::raii::DebugUtilsMessengerEXT(
        instance,
        vk::DebugUtilsMessengerCreateInfoEXT({},
                                             Severity::eWarning | Severity::eError,
                                             Type::eValidation | Type::eGeneral,
                                             hear,
                                             &options));
  }
  VkSurfaceKHR made = VK_NULL_HANDLE;
  if (glfwCreateWindowSurface(*instance, window, nullptr, &made) != VK_SUCCESS) {
    throw std::runtime_error(glfw_problem());
  }
  surface = vk::raii::SurfaceKHR(instance, made);
}

void ViewWindow::State::choose_device() {
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

void ViewWindow::State::create_device() {
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

void ViewWindow::State::create_pass() {
  const auto formats = physical.getSurfaceFormatsKHR(*surface);
  format = formats.front();
  for (const auto& candidate : formats) {
    if (candidate.format == vk::Format::eB8G8R8A8Unorm ||
        candidate.format == vk::Format::eR8G8B8A8Unorm) {
      format = candidate;
      break;
    }
  }
  const vk::AttachmentDescription colour({},
                                         format.format,
                                         vk::SampleCountFlagBits::e1,
                                         vk::AttachmentLoadOp::eLoad,
                                         vk::AttachmentStoreOp::eStore,
                                         vk::AttachmentLoadOp::eDontCare,
                                         vk::AttachmentStoreOp::eDontCare,
                                         vk::ImageLayout::eColorAttachmentOptimal,
                                         vk::ImageLayout::eColorAttachmentOptimal);
  const vk::AttachmentReference reference(0, vk::ImageLayout::eColorAttachmentOptimal);
  const vk::SubpassDescription subpass({}, vk::PipelineBindPoint::eGraphics, {}, reference);
  pass = vk::raii::RenderPass(device, vk::RenderPassCreateInfo({}, colour, subpass));
}

void ViewWindow::State::run_once() {
  commands.end();
  const vk::CommandBuffer recorded = *commands;
  queue.submit(vk::SubmitInfo({}, {}, recorded), *done);
  if (device.waitForFences(*done, VK_TRUE, kAnswerNanoseconds) != vk::Result::eSuccess) {
    throw std::runtime_error("the device does not answer");
  }
  device.resetFences(*done);
}

void ViewWindow::State::start_imgui() {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::StyleColorsDark();
  ImGui_ImplGlfw_InitForVulkan(window, true);
  ImGui_ImplVulkan_InitInfo info{};
  info.Instance = *instance;
  info.PhysicalDevice = *physical;
  info.Device = *device;
  info.QueueFamily = family;
  info.Queue = *queue;
  info.DescriptorPool = *descriptors;
  info.MinImageCount = 2;
  info.ImageCount = 2;
  info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
  ImGui_ImplVulkan_Init(&info, *pass);
  imgui = true;
  commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  ImGui_ImplVulkan_CreateFontsTexture(*commands);
  run_once();
  ImGui_ImplVulkan_DestroyFontUploadObjects();
}

void ViewWindow::State::create_swapchain() {
  device.waitIdle();
  const auto able = physical.getSurfaceCapabilitiesKHR(*surface);
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  extent = able.currentExtent;
  if (extent.width == UINT32_MAX) {
    extent.width = std::clamp(
        static_cast<std::uint32_t>(width), able.minImageExtent.width, able.maxImageExtent.width);
    extent.height = std::clamp(
        static_cast<std::uint32_t>(height), able.minImageExtent.height, able.maxImageExtent.height);
  }
  framebuffers.clear();
  views.clear();
  rendered.clear();
  images.clear();
  if (extent.width == 0 || extent.height == 0) return;
  std::uint32_t count = std::max(2U, able.minImageCount);
  if (able.maxImageCount > 0) count = std::min(count, able.maxImageCount);
  using Usage = vk::ImageUsageFlagBits;
  const vk::SwapchainCreateInfoKHR wanted(
      {},
      *surface,
      count,
      format.format,
      format.colorSpace,
      extent,
      1,
      Usage::eColorAttachment | Usage::eTransferDst | Usage::eTransferSrc,
      vk::SharingMode::eExclusive,
      {},
      able.currentTransform,
      vk::CompositeAlphaFlagBitsKHR::eOpaque,
      vk::PresentModeKHR::eFifo,
      VK_TRUE,
      *swapchain);
  swapchain = vk::raii::SwapchainKHR(device, wanted);
  for (const VkImage image : swapchain.getImages()) images.emplace_back(image);
  for (const vk::Image image : images) {
    views.emplace_back(device,
                       vk::ImageViewCreateInfo({},
                                               image,
                                               vk::ImageViewType::e2D,
                                               format.format,
                                               {},
                                               {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1}));
    const vk::ImageView view = *views.back();
    framebuffers.emplace_back(
        device, vk::FramebufferCreateInfo({}, *pass, view, extent.width, extent.height, 1));
    rendered.emplace_back(device, vk::SemaphoreCreateInfo());
  }
  resized = false;
}

std::uint32_t ViewWindow::State::memory_type(std::uint32_t allowed,
                                             vk::MemoryPropertyFlags needed) const {
  const auto memory = physical.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & needed) == needed) {
      return i;
    }
  }
  throw std::runtime_error("the device has no memory of the kind needed");
}

void ViewWindow::State::make_staging(vk::DeviceSize bytes) {
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

void ViewWindow::State::make_picture(vk::Extent2D size) {
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

void ViewWindow::State::record(std::uint32_t index, const Image<std::uint8_t>& shown, bool keep) {
  using Layout = vk::ImageLayout;
  using Access = vk::AccessFlagBits;
  using Stage = vk::PipelineStageFlagBits;
  const vk::Image target = images[index];
  std::memcpy(staging.mapped, shown.samples().data(), shown.samples().size());
  commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  commands.pipelineBarrier(
      Stage::eTransfer,
      Stage::eTransfer,
      {},
      {},
      {},
      {moved(*picture.image,
             Layout::eUndefined,
             Layout::eTransferDstOptimal,
             {},
             Access::eTransferWrite),
       moved(target, Layout::eUndefined, Layout::eTransferDstOptimal, {}, Access::eTransferWrite)});
  commands.copyBufferToImage(
      *staging.buffer,
      *picture.image,
      Layout::eTransferDstOptimal,
      vk::BufferImageCopy(0, 0, 0, kColour, {}, {picture_extent.width, picture_extent.height, 1}));
  commands.pipelineBarrier(Stage::eTransfer,
                           Stage::eTransfer,
                           {},
                           {},
                           {},
                           moved(*picture.image,
                                 Layout::eTransferDstOptimal,
                                 Layout::eTransferSrcOptimal,
                                 Access::eTransferWrite,
                                 Access::eTransferRead));
  const auto corner = [](vk::Extent2D size) {
    return vk::Offset3D(
        static_cast<std::int32_t>(size.width), static_cast<std::int32_t>(size.height), 1);
  };
  commands.blitImage(*picture.image,
                     Layout::eTransferSrcOptimal,
                     target,
                     Layout::eTransferDstOptimal,
                     vk::ImageBlit(kColour,
                                   {vk::Offset3D(), corner(picture_extent)},
                                   kColour,
                                   {vk::Offset3D(), corner(extent)}),
                     vk::Filter::eLinear);
  commands.pipelineBarrier(Stage::eTransfer,
                           Stage::eColorAttachmentOutput,
                           {},
                           {},
                           {},
                           moved(target,
                                 Layout::eTransferDstOptimal,
                                 Layout::eColorAttachmentOptimal,
                                 Access::eTransferWrite,
                                 Access::eColorAttachmentRead | Access::eColorAttachmentWrite));
  commands.beginRenderPass(vk::RenderPassBeginInfo(*pass, *framebuffers[index], {{}, extent}),
                           vk::SubpassContents::eInline);
  ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), *commands);
  commands.endRenderPass();
  if (keep) {
    record_keeping(target);
  } else {
    commands.pipelineBarrier(Stage::eColorAttachmentOutput,
                             Stage::eBottomOfPipe,
                             {},
                             {},
                             {},
                             moved(target,
                                   Layout::eColorAttachmentOptimal,
                                   Layout::ePresentSrcKHR,
                                   Access::eColorAttachmentWrite,
                                   {}));
  }
  commands.end();
}

void ViewWindow::State::record_keeping(vk::Image image) {
  using Layout = vk::ImageLayout;
  using Access = vk::AccessFlagBits;
  using Stage = vk::PipelineStageFlagBits;
  commands.pipelineBarrier(Stage::eColorAttachmentOutput | Stage::eTransfer,
                           Stage::eTransfer,
                           {},
                           vk::MemoryBarrier(Access::eTransferRead, Access::eTransferWrite),
                           {},
                           moved(image,
                                 Layout::eColorAttachmentOptimal,
                                 Layout::eTransferSrcOptimal,
                                 Access::eColorAttachmentWrite,
                                 Access::eTransferRead));
  commands.copyImageToBuffer(
      image,
      Layout::eTransferSrcOptimal,
      *staging.buffer,
      vk::BufferImageCopy(0, 0, 0, kColour, {}, {extent.width, extent.height, 1}));
  commands.pipelineBarrier(
      Stage::eTransfer,
      Stage::eBottomOfPipe | Stage::eHost,
      {},
      vk::MemoryBarrier(Access::eTransferWrite, Access::eHostRead),
      {},
      moved(image, Layout::eTransferSrcOptimal, Layout::ePresentSrcKHR, Access::eTransferRead, {}));
}

void ViewWindow::State::read(Image<std::uint8_t>& seen) const {
  const bool blue_first = format.format == vk::Format::eB8G8R8A8Unorm;
  const auto* const bytes = static_cast<const std::uint8_t*>(staging.mapped);
  seen = Image<std::uint8_t>(static_cast<int>(extent.width), static_cast<int>(extent.height), 3);
  std::size_t at = 0;
  for (int y = 0; y < seen.height(); ++y) {
    for (int x = 0; x < seen.width(); ++x, at += 4) {
      for (int c = 0; c < 3; ++c) seen.at(x, y, c) = bytes[at + (blue_first ? 2 - c : c)];
    }
  }
}

bool ViewWindow::State::show(const Image<std::uint8_t>& shown, Image<std::uint8_t>* seen) {
  if (resized || images.empty()) create_swapchain();
  if (images.empty()) return false;
  const vk::DeviceSize window_bytes = vk::DeviceSize{4} * extent.width * extent.height;
  make_staging(std::max<vk::DeviceSize>(shown.samples().size(), window_bytes));
  make_picture(
      {static_cast<std::uint32_t>(shown.width()), static_cast<std::uint32_t>(shown.height())});
  std::uint32_t index = 0;
  try {
    index = swapchain.acquireNextImage(kAnswerNanoseconds, *acquired).second;
  } catch (const vk::OutOfDateKHRError&) {
    resized = true;
    return false;
  }
  record(index, shown, seen != nullptr);
  const vk::PipelineStageFlags stage = vk::PipelineStageFlagBits::eTransfer;
  const vk::Semaphore wait = *acquired;
  const vk::Semaphore signal = *rendered[index];
  const vk::CommandBuffer recorded = *commands;
  queue.submit(vk::SubmitInfo(wait, stage, recorded, signal), *done);
  if (device.waitForFences(*done, VK_TRUE, kAnswerNanoseconds) != vk::Result::eSuccess) {
    throw std::runtime_error("the device does not answer");
  }
  device.resetFences(*done);
  if (seen != nullptr) read(*seen);
  try {
    const vk::SwapchainKHR chain = *swapchain;
    if (queue.presentKHR(vk::PresentInfoKHR(signal, chain, index)) != vk::Result::eSuccess) {
      resized = true;
    }
  } catch (const vk::OutOfDateKHRError&) {
    resized = true;
  }
  return true;
}

ViewWindow::ViewWindow(std::unique_ptr<State> state) : state_(std::move(state)) {}
ViewWindow::~ViewWindow() = default;

Result<std::unique_ptr<ViewWindow>> ViewWindow::create(const ViewWindowOptions& options) {
  auto made = presenting("opening a window", [&] {
    auto state = std::make_unique<State>();
    state->options = options;
    state->open_window();
    state->create_instance();
    state->choose_device();
    state->create_device();
    state->create_pass();
    state->start_imgui();
    return state;
  });
  if (!made) return made.error();
  return std::unique_ptr<ViewWindow>(new ViewWindow(*std::move(made)));
}

bool ViewWindow::wants_to_close() const { return glfwWindowShouldClose(state_->window) != 0; }

void ViewWindow::listen(double seconds) {
  if (seconds > 0.0) {
    glfwWaitEventsTimeout(seconds);
  } else {
    glfwPollEvents();
  }
}

std::optional<ViewWindow::Size> ViewWindow::size() const {
  Size size;
  glfwGetFramebufferSize(state_->window, &size.width, &size.height);
  if (size.width <= 0 || size.height <= 0) return std::nullopt;
  if (glfwGetWindowAttrib(state_->window, GLFW_ICONIFIED) != 0) return std::nullopt;
  return size;
}

void ViewWindow::resize(int width, int height) { glfwSetWindowSize(state_->window, width, height); }
void ViewWindow::minimise() { glfwIconifyWindow(state_->window); }
void ViewWindow::restore() { glfwRestoreWindow(state_->window); }

std::string ViewWindow::device() const {
  return state_->physical.getProperties().deviceName.data();
}

void ViewWindow::begin() {
  ImGui_ImplVulkan_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

Result<bool> ViewWindow::present(const Image<std::uint8_t>& picture, Image<std::uint8_t>* seen) {
  ImGui::Render();
  return presenting("showing a picture", [&] { return state_->show(picture, seen); });
}

}  // namespace opaline::daemon
