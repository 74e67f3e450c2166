#include <algorithm>

#include "daemon/view/view_device.h"

namespace opaline::daemon {

void ViewSwapchain::create_pass(const ViewDevice& of) {
  const auto formats = of.physical.getSurfaceFormatsKHR(*of.surface);
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
  pass = vk::raii::RenderPass(of.device, vk::RenderPassCreateInfo({}, colour, subpass));
}

void ViewSwapchain::create_swapchain(ViewDevice& of) {
  of.device.waitIdle();
  const auto able = of.physical.getSurfaceCapabilitiesKHR(*of.surface);
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(of.window, &width, &height);
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
      *of.surface,
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
  swapchain = vk::raii::SwapchainKHR(of.device, wanted);
  for (const VkImage image : swapchain.getImages()) images.emplace_back(image);
  for (const vk::Image image : images) {
    views.emplace_back(of.device,
                       vk::ImageViewCreateInfo({},
                                               image,
                                               vk::ImageViewType::e2D,
                                               format.format,
                                               {},
                                               {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1}));
    const vk::ImageView view = *views.back();
    framebuffers.emplace_back(
        of.device, vk::FramebufferCreateInfo({}, *pass, view, extent.width, extent.height, 1));
    rendered.emplace_back(of.device, vk::SemaphoreCreateInfo());
  }
  of.resized = false;
}

}  // namespace opaline::daemon
