#include "render/raster/sent_buffer.h"

#include <algorithm>

namespace opaline::render {
namespace {

constexpr std::uint64_t kLeast = 16;

}  // namespace

Result<void> SentBuffer::send(gpu::Context& context,
                              std::span<const std::byte> bytes,
                              gpu::Commands& commands) {
  const std::uint64_t size = std::max<std::uint64_t>(kLeast, bytes.size());
  if (!device_ || device_->bytes() != size) {
    device_.reset();
    host_.reset();
    auto host = gpu::Buffer::create(context, size, gpu::Memory::kHost);
    if (!host) return host.error();
    auto device = gpu::Buffer::create(context, size, gpu::Memory::kDevice);
    if (!device) return device.error();
    host_ = *std::move(host);
    device_ = *std::move(device);
    std::ranges::fill(host_->mapped(), std::byte{0});
  }
  std::ranges::copy(bytes, host_->mapped().begin());
  commands.copy(*host_, *device_, size);
  return ok();
}

}  // namespace opaline::render
