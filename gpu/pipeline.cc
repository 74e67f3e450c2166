#include "gpu/pipeline.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "gpu/handles.h"

namespace opaline::gpu {
namespace {

using Stage = vk::ShaderStageFlagBits;

/// The layouts, with push descriptors: buffers are named when a command is recorded, no descriptor
/// pools.
void create_layout(Pipeline::Handles& h) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  for (std::uint32_t i = 0; i < h.interface.buffers; ++i)
    bindings.emplace_back(i, buffer_type(h.interface, i), 1, h.stages);
  const auto& device = h.context->device;
  h.set_layout = vk::raii::DescriptorSetLayout(
      device, {vk::DescriptorSetLayoutCreateFlagBits::ePushDescriptorKHR, bindings});
  const vk::PushConstantRange push(h.stages, 0, h.interface.push_bytes);
  vk::PipelineLayoutCreateInfo layout({}, *h.set_layout);
  if (h.interface.push_bytes > 0) layout.setPushConstantRanges(push);
  h.layout = vk::raii::PipelineLayout(device, layout);
}

vk::raii::ShaderModule module_of(const Context::Handles& context,
                                 std::span<const std::uint32_t> spirv) {
  return {context.device, {{}, spirv.size_bytes(), spirv.data()}};
}

std::unique_ptr<Pipeline::Handles> handles_for(Context& context,
                                               const Interface& interface,
                                               vk::ShaderStageFlags stages) {
  auto h = std::make_unique<Pipeline::Handles>();
  h->context = &context.handles();
  h->interface = interface;
  h->stages = stages;
  return h;
}

void create_kernel(Pipeline::Handles& h,
                   std::span<const std::uint32_t> spirv,
                   std::span<const std::uint32_t> constants) {
  create_layout(h);
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < constants.size(); ++i) entries.emplace_back(i, 4 * i, 4);
  const vk::SpecializationInfo specialization(static_cast<std::uint32_t>(entries.size()),
                                              entries.data(),
                                              constants.size_bytes(),
                                              constants.data());
  const auto module = module_of(*h.context, spirv);
  const vk::PipelineShaderStageCreateInfo stage(
      {}, Stage::eCompute, *module, "main", &specialization);
  h.pipeline = vk::raii::Pipeline(
      h.context->device, nullptr, vk::ComputePipelineCreateInfo({}, stage, *h.layout));
}

/// The nearest is kept; nothing is blended. Without a fragment shader there is only depth.
void create_drawing(Pipeline::Handles& h,
                    std::span<const std::uint32_t> vertex,
                    std::span<const std::uint32_t> fragment,
                    Sides sides) {
  create_layout(h);
  const auto vertex_module = module_of(*h.context, vertex);
  std::vector stages{vk::PipelineShaderStageCreateInfo({}, Stage::eVertex, *vertex_module, "main")};
  vk::raii::ShaderModule fragment_module = nullptr;
  if (!fragment.empty()) {
    fragment_module = module_of(*h.context, fragment);
    stages.emplace_back(
        vk::PipelineShaderStageCreateFlags(), Stage::eFragment, *fragment_module, "main");
  }
  const vk::PipelineVertexInputStateCreateInfo no_input;
  const vk::PipelineInputAssemblyStateCreateInfo triangles({},
                                                           vk::PrimitiveTopology::eTriangleList);
  const vk::PipelineViewportStateCreateInfo viewport({}, 1, nullptr, 1, nullptr);
  vk::PipelineRasterizationStateCreateInfo raster;
  raster.setLineWidth(1.0F);
  if (sides == Sides::kFront) raster.setCullMode(vk::CullModeFlagBits::eBack);
  const vk::PipelineMultisampleStateCreateInfo one_sample;
  const vk::PipelineDepthStencilStateCreateInfo depth(
      {}, VK_TRUE, VK_TRUE, vk::CompareOp::eGreaterOrEqual);
  vk::PipelineColorBlendAttachmentState write;
  write.setColorWriteMask(vk::FlagTraits<vk::ColorComponentFlagBits>::allFlags);
  vk::PipelineColorBlendStateCreateInfo blend;
  if (!fragment.empty()) blend.setAttachments(write);
  static constexpr std::array dynamic{vk::DynamicState::eViewport, vk::DynamicState::eScissor};
  const vk::PipelineDynamicStateCreateInfo dynamic_state({}, dynamic);
  vk::PipelineRenderingCreateInfo formats;
  formats.setDepthAttachmentFormat(kDepthFormat);
  if (!fragment.empty()) formats.setColorAttachmentFormats(kColorFormat);
  vk::GraphicsPipelineCreateInfo info({},
                                      stages,
                                      &no_input,
                                      &triangles,
                                      nullptr,
                                      &viewport,
                                      &raster,
                                      &one_sample,
                                      &depth,
                                      &blend,
                                      &dynamic_state,
                                      *h.layout);
  info.setPNext(&formats);
  h.pipeline = vk::raii::Pipeline(h.context->device, nullptr, info);
}

}  // namespace

Pipeline::Pipeline(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

Result<Pipeline> Pipeline::create_compute(Context& context,
                                          std::string_view name,
                                          std::span<const std::uint32_t> spirv,
                                          const Interface& interface,
                                          std::span<const std::uint32_t> constants) {
  auto h = handles_for(context, interface, Stage::eCompute);
  auto made = guarded(fmt::format("kernel {}", name), [&] { create_kernel(*h, spirv, constants); });
  if (!made) return made.error();
  return Pipeline(std::move(h));
}

Result<Pipeline> Pipeline::create_raster(Context& context,
                                         std::string_view name,
                                         std::span<const std::uint32_t> vertex_spirv,
                                         std::span<const std::uint32_t> fragment_spirv,
                                         const Interface& interface,
                                         Sides sides) {
  auto h = handles_for(context, interface, Stage::eVertex | Stage::eFragment);
  auto made = guarded(fmt::format("shaders of {}", name),
                      [&] { create_drawing(*h, vertex_spirv, fragment_spirv, sides); });
  if (!made) return made.error();
  return Pipeline(std::move(h));
}

Result<Pipeline> Pipeline::create_depth(Context& context,
                                        std::string_view name,
                                        std::span<const std::uint32_t> vertex_spirv,
                                        const Interface& interface) {
  auto h = handles_for(context, interface, Stage::eVertex);
  auto made = guarded(fmt::format("shader of {}", name),
                      [&] { create_drawing(*h, vertex_spirv, {}, Sides::kBoth); });
  if (!made) return made.error();
  return Pipeline(std::move(h));
}

}  // namespace opaline::gpu
