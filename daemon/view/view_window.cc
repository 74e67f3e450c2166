#include "daemon/view/view_window.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cstring>

#include "base/log.h"
#include "daemon/view/view_device.h"
#include "gpu/handles.h"

namespace opaline::daemon {
namespace {

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

struct ViewWindow::State : ViewDevice, ViewSwapchain {
  bool imgui = false;

  explicit State(const ViewWindowOptions& wanted) { options = wanted; }
  ~State();
  void start_imgui();
  void record(std::uint32_t index, const Image<std::uint8_t>& shown, bool keep);
  void record_keeping(vk::Image image);
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
  if (resized || images.empty()) create_swapchain(*this);
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
  auto made = gpu::guarded("opening a window", [&] {
    auto state = std::make_unique<State>(options);
    state->open_window();
    state->create_instance();
    state->choose_device();
    state->create_device();
    state->create_pass(*state);
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
  return gpu::guarded("showing a picture", [&] { return state_->show(picture, seen); });
}

}  // namespace opaline::daemon
