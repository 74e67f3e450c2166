#include "gpu/image.h"

#include <fmt/format.h>

#include "gpu/handles.h"

namespace opaline::gpu {
namespace {

struct Plane {
  vk::raii::Image image = nullptr;
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::ImageView view = nullptr;
};

vk::ImageCreateInfo describe(vk::Format format, vk::Extent3D size, vk::ImageUsageFlags usage) {
  vk::ImageCreateInfo info;
  info.setImageType(vk::ImageType::e2D).setFormat(format).setExtent(size).setUsage(usage);
  return info.setMipLevels(1).setArrayLayers(1);
}

Result<Plane> create_plane(const Context::Handles& context,
                           const vk::ImageCreateInfo& info,
                           vk::ImageAspectFlags aspect) {
  Plane plane;
  auto made = guarded("a render target", [&] {
    plane.image = vk::raii::Image(context.device, info);
    return plane.image.getMemoryRequirements();
  });
  if (!made) return made.error();
  const auto type =
      context.memory_type(made->memoryTypeBits, vk::MemoryPropertyFlagBits::eDeviceLocal, {});
  if (!type) return type.error();
  auto bound = guarded("a render target", [&] {
    plane.memory = vk::raii::DeviceMemory(context.device, {made->size, *type});
    plane.image.bindMemory(*plane.memory, 0);
    vk::ImageViewCreateInfo view({}, *plane.image, vk::ImageViewType::e2D, info.format);
    view.setSubresourceRange({aspect, 0, 1, 0, 1});
    plane.view = vk::raii::ImageView(context.device, view);
  });
  if (!bound) return bound.error();
  return plane;
}

}  // namespace

RenderTarget::RenderTarget(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}
RenderTarget::RenderTarget(RenderTarget&&) noexcept = default;
RenderTarget& RenderTarget::operator=(RenderTarget&&) noexcept = default;
RenderTarget::~RenderTarget() = default;

std::uint32_t RenderTarget::width() const { return handles_->width; }
std::uint32_t RenderTarget::height() const { return handles_->height; }

Result<RenderTarget> RenderTarget::create(Context& context,
                                          std::uint32_t width,
                                          std::uint32_t height) {
  return made(context, width, height, /*with_color=*/true);
}

Result<RenderTarget> RenderTarget::create_depth(Context& context,
                                                std::uint32_t width,
                                                std::uint32_t height) {
  return made(context, width, height, /*with_color=*/false);
}

Result<RenderTarget> RenderTarget::made(Context& context,
                                        std::uint32_t width,
                                        std::uint32_t height,
                                        bool with_color) {
  const std::uint32_t most = context.device().max_image_side;
  if (width == 0 || height == 0 || width > most || height > most)
    return invalid_argument(fmt::format(
        "a render target of {} x {} pixels; 1 to {} a side are possible", width, height, most));
  using Usage = vk::ImageUsageFlagBits;
  const vk::Extent3D size(width, height, 1);
  Result<Plane> color = Plane();
  if (with_color) {
    color =
        create_plane(context.handles(),
                     describe(kColorFormat, size, Usage::eColorAttachment | Usage::eTransferSrc),
                     vk::ImageAspectFlagBits::eColor);
  }
  if (!color) return color.error();
  auto depth = create_plane(
      context.handles(),
      describe(kDepthFormat, size, Usage::eDepthStencilAttachment | Usage::eTransferSrc),
      vk::ImageAspectFlagBits::eDepth);
  if (!depth) return depth.error();
  auto h = std::make_unique<Handles>();
  h->context = &context.handles();
  h->width = width;
  h->height = height;
  h->color = std::move(color->image);
  h->color_memory = std::move(color->memory);
  h->color_view = std::move(color->view);
  h->depth = std::move(depth->image);
  h->depth_memory = std::move(depth->memory);
  h->depth_view = std::move(depth->view);
  return RenderTarget(std::move(h));
}

}  // namespace opaline::gpu
