#include "gpu/buffer.h"

#include <fmt/format.h>

#include <algorithm>

#include "gpu/handles.h"

namespace opaline::gpu {
namespace {

using Property = vk::MemoryPropertyFlagBits;
using Usage = vk::BufferUsageFlagBits;

vk::BufferCreateInfo describe(std::uint64_t bytes) {
  return {{},
          bytes,
          Usage::eStorageBuffer | Usage::eUniformBuffer | Usage::eIndexBuffer |
              Usage::eTransferSrc | Usage::eTransferDst,
          vk::SharingMode::eExclusive};
}

Result<std::uint32_t> memory_type(const Context::Handles& context,
                                  std::uint32_t allowed,
                                  Memory memory) {
  if (memory == Memory::kDevice) return context.memory_type(allowed, Property::eDeviceLocal, {});
  return context.memory_type(
      allowed, Property::eHostVisible | Property::eHostCoherent, Property::eHostCached);
}

Result<void> allocate(Buffer::Handles& h, Memory memory) {
  const vk::MemoryRequirements needs = h.buffer.getMemoryRequirements();
  Context::Handles& context = *h.context;
  const auto type = memory_type(context, needs.memoryTypeBits, memory);
  if (!type) return type.error();
  return guarded("allocating", [&] {
    const bool rehearsed = ++context.allocations == context.options.rehearsal.full_at_allocation;
    if (rehearsed || context.allocated_bytes + needs.size > context.info.memory_bytes)
      throw vk::OutOfDeviceMemoryError("");
    h.memory = vk::raii::DeviceMemory(context.device, {needs.size, *type});
    h.allocated_bytes = needs.size;
    context.allocated_bytes += needs.size;
    h.buffer.bindMemory(*h.memory, 0);
    if (memory == Memory::kHost)
      h.mapped = static_cast<std::byte*>(h.memory.mapMemory(0, VK_WHOLE_SIZE));
  });
}

Result<void> run_copy(Context& context, const Buffer& from, Buffer& to, std::uint64_t bytes) {
  auto commands = Commands::create(context);
  if (!commands) return commands.error();
  if (auto begun = commands->begin(); !begun) return begun.error();
  commands->copy(from, to, bytes);
  commands->barrier();
  if (auto ended = commands->end(); !ended) return ended.error();
  return context.run(*commands);
}

}  // namespace

Buffer::Buffer(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;
Buffer::~Buffer() = default;

Result<Buffer> Buffer::create(Context& context, std::uint64_t bytes, Memory memory) {
  const DeviceInfo& device = context.device();
  const std::uint64_t most = std::min(device.max_binding_bytes, device.max_allocation_bytes);
  if (bytes == 0 || bytes > most)
    return invalid_argument(
        fmt::format("a GPU buffer of {} bytes; {} allows 1 to {}", bytes, device.name, most));
  auto h = std::make_unique<Handles>();
  h->context = &context.handles();
  h->bytes = bytes;
  const std::string what =
      fmt::format("a GPU buffer of {:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
  auto made =
      guarded(what, [&] { h->buffer = vk::raii::Buffer(h->context->device, describe(bytes)); });
  if (!made) return made.error();
  if (auto allocated = allocate(*h, memory); !allocated) return allocated.error().in(what);
  return Buffer(std::move(h));
}

std::uint64_t Buffer::bytes() const { return handles_->bytes; }

std::span<std::byte> Buffer::mapped() {
  ENSURE(handles_->mapped != nullptr);
  return {handles_->mapped, handles_->bytes};
}

std::span<float> Buffer::floats() {
  const std::span<std::byte> bytes = mapped();
  return {reinterpret_cast<float*>(bytes.data()), bytes.size() / sizeof(float)};
}

Result<Buffer> create_filled(Context& context, std::span<const std::byte> from) {
  auto buffer = Buffer::create(context, from.size(), Memory::kDevice);
  if (!buffer) return buffer;
  if (auto sent = upload(context, from, *buffer); !sent) return sent.error();
  return buffer;
}

Result<void> upload(Context& context, std::span<const std::byte> from, Buffer& to) {
  ENSURE(from.size() <= to.bytes());
  auto staging = Buffer::create(context, from.size(), Memory::kHost);
  if (!staging) return staging.error();
  std::ranges::copy(from, staging->mapped().begin());
  context.handles().traffic.uploaded_bytes += from.size();
  return run_copy(context, *staging, to, from.size());
}

Result<void> download(Context& context, const Buffer& from, std::span<std::byte> to) {
  ENSURE(to.size() <= from.bytes());
  auto staging = Buffer::create(context, to.size(), Memory::kHost);
  if (!staging) return staging.error();
  if (auto copied = run_copy(context, from, *staging, to.size()); !copied) return copied.error();
  std::ranges::copy(staging->mapped(), to.begin());
  context.handles().traffic.downloaded_bytes += to.size();
  return ok();
}

}  // namespace opaline::gpu
