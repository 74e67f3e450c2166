#pragma once

#include <optional>

#include "gpu/commands.h"

namespace opaline::render {

/// A buffer of the device's that is sent anew now and then, through a host buffer that is kept.
class SentBuffer {
 public:
  /// Records the copy; the bytes are read now. Wait for the commands before the next send(). Nothing to send is sent as 16
  /// zeros: a binding wants something. Errors: those of Buffer.
  Result<void> send(gpu::Context& context,
                    std::span<const std::byte> bytes,
                    gpu::Commands& commands);
  template <class T>
  Result<void> send(gpu::Context& context, const std::vector<T>& values, gpu::Commands& commands) {
    return send(context, std::as_bytes(std::span(values)), commands);
  }

  bool is_there() const { return device_.has_value(); }
  const gpu::Buffer& buffer() const { return *device_; }

 private:
  std::optional<gpu::Buffer> host_;
  std::optional<gpu::Buffer> device_;
};

}  // namespace opaline::render
