#include "gpu/commands.h"

#include <array>
#include <vector>

#include "gpu/handles.h"

namespace opaline::gpu {
namespace {

using Access = vk::AccessFlagBits2;
using Layout = vk::ImageLayout;
using StageBit = vk::PipelineStageFlagBits2;

void bind(const vk::raii::CommandBuffer& commands,
          const Pipeline& pipeline,
          vk::PipelineBindPoint point,
          const Arguments& arguments) {
  const Pipeline::Handles& h = pipeline.handles();
  ENSURE(arguments.buffers.size() == h.interface.buffers);
  ENSURE(arguments.push.size() == h.interface.push_bytes);
  commands.bindPipeline(point, *h.pipeline);
  std::vector<vk::DescriptorBufferInfo> infos;
  infos.reserve(arguments.buffers.size());
  std::vector<vk::WriteDescriptorSet> writes;
  for (const Buffer* buffer : arguments.buffers) {
    const auto binding = static_cast<std::uint32_t>(infos.size());
    infos.emplace_back(*buffer->handles().buffer, 0, VK_WHOLE_SIZE);
    writes.emplace_back(
        nullptr, binding, 0, 1, buffer_type(h.interface, binding), nullptr, &infos.back());
  }
  if (!writes.empty()) commands.pushDescriptorSetKHR(point, *h.layout, 0, writes);
  if (!arguments.push.empty())
    commands.pushConstants<std::byte>(
        *h.layout,
        h.stages,
        0,
        {static_cast<std::uint32_t>(arguments.push.size()), arguments.push.data()});
}

vk::ImageMemoryBarrier2 transition(const vk::raii::Image& image,
                                   vk::ImageAspectFlags aspect,
                                   Layout from,
                                   Layout to) {
  vk::ImageMemoryBarrier2 barrier(StageBit::eAllCommands,
                                  Access::eMemoryWrite,
                                  StageBit::eAllCommands,
                                  Access::eMemoryRead | Access::eMemoryWrite,
                                  from,
                                  to);
  barrier.setImage(*image).setSubresourceRange({aspect, 0, 1, 0, 1});
  return barrier;
}

vk::RenderingAttachmentInfo attached(const vk::raii::ImageView& view, bool clear) {
  vk::RenderingAttachmentInfo info(*view, Layout::eAttachmentOptimal);
  return info.setLoadOp(clear ? vk::AttachmentLoadOp::eClear : vk::AttachmentLoadOp::eLoad)
      .setStoreOp(vk::AttachmentStoreOp::eStore);
}

/// Planes that are cleared start undefined, whatever they held.
void make_attachments(const vk::raii::CommandBuffer& commands,
                      const RenderTarget::Handles& target,
                      bool clear) {
  const Layout before = clear ? Layout::eUndefined : Layout::eAttachmentOptimal;
  std::vector barriers{transition(
      target.depth, vk::ImageAspectFlagBits::eDepth, before, Layout::eAttachmentOptimal)};
  if (*target.color) {
    barriers.push_back(transition(
        target.color, vk::ImageAspectFlagBits::eColor, before, Layout::eAttachmentOptimal));
  }
  commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, barriers));
}

void copy_plane(const vk::raii::CommandBuffer& commands,
                const vk::raii::Image& image,
                vk::ImageAspectFlagBits aspect,
                const RenderTarget::Handles& target,
                const Buffer& to,
                std::uint64_t first_byte = 0) {
  const auto source =
      transition(image, aspect, Layout::eAttachmentOptimal, Layout::eTransferSrcOptimal);
  commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, source));
  const vk::BufferImageCopy region(
      first_byte, 0, 0, {aspect, 0, 0, 1}, {0, 0, 0}, {target.width, target.height, 1});
  commands.copyImageToBuffer(*image, Layout::eTransferSrcOptimal, *to.handles().buffer, region);
}

}  // namespace

Commands::Commands(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}
Commands::Commands(Commands&&) noexcept = default;
Commands& Commands::operator=(Commands&&) noexcept = default;
Commands::~Commands() = default;

Result<Commands> Commands::create(Context& context) {
  auto h = std::make_unique<Handles>();
  h->context = &context.handles();
  auto made = guarded("a command buffer", [&] {
    const auto& device = h->context->device;
    h->pool = vk::raii::CommandPool(device, {{}, h->context->queue_family});
    vk::raii::CommandBuffers buffers(device, {*h->pool, vk::CommandBufferLevel::ePrimary, 1});
    h->commands = std::move(buffers.front());
  });
  if (!made) return made.error();
  return Commands(std::move(h));
}

Result<void> Commands::begin() {
  return guarded("recording GPU commands", [&] {
    handles_->pool.reset();
    handles_->commands.begin({});
  });
}

Result<void> Commands::end() {
  return guarded("recording GPU commands", [&] { handles_->commands.end(); });
}

void Commands::dispatch(const Pipeline& kernel,
                        const Arguments& arguments,
                        std::array<std::uint32_t, 3> groups) {
  bind(handles_->commands, kernel, vk::PipelineBindPoint::eCompute, arguments);
  handles_->commands.dispatch(groups[0], groups[1], groups[2]);
}

void Commands::begin_drawing(const Pipeline& raster,
                             const Arguments& arguments,
                             RenderTarget& target,
                             bool clear) {
  const vk::raii::CommandBuffer& commands = handles_->commands;
  const RenderTarget::Handles& t = target.handles();
  make_attachments(commands, t, clear);
  const vk::Rect2D area({0, 0}, {t.width, t.height});
  const auto color = attached(t.color_view, clear);
  const auto depth = attached(t.depth_view, clear);
  vk::RenderingInfo info;
  info.setRenderArea(area).setLayerCount(1).setPDepthAttachment(&depth);
  if (*t.color) info.setColorAttachments(color);
  commands.beginRendering(info);
  bind(commands, raster, vk::PipelineBindPoint::eGraphics, arguments);
  commands.setViewport(
      0, vk::Viewport(0, 0, static_cast<float>(t.width), static_cast<float>(t.height), 0, 1));
  commands.setScissor(0, area);
}

void Commands::draw(const Pipeline& raster,
                    const Arguments& arguments,
                    std::uint32_t vertices,
                    RenderTarget& target) {
  begin_drawing(raster, arguments, target, /*clear=*/true);
  handles_->commands.draw(vertices, 1, 0, 0);
  handles_->commands.endRendering();
}

void Commands::draw(const Pipeline& raster,
                    const Arguments& arguments,
                    const Indexed& triangles,
                    RenderTarget& target,
                    bool clear) {
  ENSURE(4 * (std::uint64_t{triangles.first} + triangles.count) <= triangles.indices.bytes());
  begin_drawing(raster, arguments, target, clear);
  handles_->commands.bindIndexBuffer(
      *triangles.indices.handles().buffer, 0, vk::IndexType::eUint32);
  handles_->commands.drawIndexed(triangles.count, 1, triangles.first, 0, 0);
  handles_->commands.endRendering();
}

void Commands::copy_color(const RenderTarget& from, Buffer& to) {
  ENSURE(to.bytes() >= from.color_bytes());
  const RenderTarget::Handles& t = from.handles();
  copy_plane(handles_->commands, t.color, vk::ImageAspectFlagBits::eColor, t, to);
}

void Commands::copy_depth(const RenderTarget& from, Buffer& to, std::uint64_t first_byte) {
  ENSURE(to.bytes() >= first_byte + from.depth_bytes());
  const RenderTarget::Handles& t = from.handles();
  copy_plane(handles_->commands, t.depth, vk::ImageAspectFlagBits::eDepth, t, to, first_byte);
}

void Commands::copy(const Buffer& from, Buffer& to, std::uint64_t bytes) {
  ENSURE(bytes <= from.bytes() && bytes <= to.bytes());
  handles_->commands.copyBuffer(
      *from.handles().buffer, *to.handles().buffer, vk::BufferCopy(0, 0, bytes));
}

void Commands::fill_zero(Buffer& buffer) {
  handles_->commands.fillBuffer(*buffer.handles().buffer, 0, VK_WHOLE_SIZE, 0);
}

void Commands::barrier() {
  const vk::MemoryBarrier2 all(StageBit::eAllCommands,
                               Access::eMemoryWrite,
                               StageBit::eAllCommands | StageBit::eHost,
                               Access::eMemoryRead | Access::eMemoryWrite | Access::eHostRead);
  handles_->commands.pipelineBarrier2(vk::DependencyInfo({}, all));
}

}  // namespace opaline::gpu
