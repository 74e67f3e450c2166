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
        nullptr, binding, 0, 1, vk::DescriptorType::eStorageBuffer, nullptr, &infos.back());
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

vk::RenderingAttachmentInfo cleared(const vk::raii::ImageView& view, vk::AttachmentStoreOp store) {
  vk::RenderingAttachmentInfo info(*view, Layout::eAttachmentOptimal);
  return info.setLoadOp(vk::AttachmentLoadOp::eClear).setStoreOp(store);
}

/// Both planes start undefined: whatever they held is cleared.
void make_attachments(const vk::raii::CommandBuffer& commands,
                      const RenderTarget::Handles& target) {
  const std::array barriers{transition(target.color,
                                       vk::ImageAspectFlagBits::eColor,
                                       Layout::eUndefined,
                                       Layout::eAttachmentOptimal),
                            transition(target.depth,
                                       vk::ImageAspectFlagBits::eDepth,
                                       Layout::eUndefined,
                                       Layout::eAttachmentOptimal)};
  commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, barriers));
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

void Commands::draw(const Pipeline& raster,
                    const Arguments& arguments,
                    std::uint32_t vertices,
                    RenderTarget& target) {
  const vk::raii::CommandBuffer& commands = handles_->commands;
  const RenderTarget::Handles& t = target.handles();
  make_attachments(commands, t);
  const vk::Rect2D area({0, 0}, {t.width, t.height});
  const auto color = cleared(t.color_view, vk::AttachmentStoreOp::eStore);
  const auto depth = cleared(t.depth_view, vk::AttachmentStoreOp::eDontCare);
  commands.beginRendering(vk::RenderingInfo({}, area, 1, 0, color, &depth));
  bind(commands, raster, vk::PipelineBindPoint::eGraphics, arguments);
  commands.setViewport(
      0, vk::Viewport(0, 0, static_cast<float>(t.width), static_cast<float>(t.height), 0, 1));
  commands.setScissor(0, area);
  commands.draw(vertices, 1, 0, 0);
  commands.endRendering();
}

void Commands::copy_color(const RenderTarget& from, Buffer& to) {
  ENSURE(to.bytes() >= from.color_bytes());
  const RenderTarget::Handles& t = from.handles();
  const auto source = transition(t.color,
                                 vk::ImageAspectFlagBits::eColor,
                                 Layout::eAttachmentOptimal,
                                 Layout::eTransferSrcOptimal);
  handles_->commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, source));
  const vk::BufferImageCopy region(
      0, 0, 0, {vk::ImageAspectFlagBits::eColor, 0, 0, 1}, {0, 0, 0}, {t.width, t.height, 1});
  handles_->commands.copyImageToBuffer(
      *t.color, Layout::eTransferSrcOptimal, *to.handles().buffer, region);
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
