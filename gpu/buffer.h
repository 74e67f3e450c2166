#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/result.h"

namespace opaline::gpu {

class Context;

enum class Memory : std::uint8_t {
  kDevice,  ///< fast for the device; the host writes and reads through copies
  kHost,    ///< the host sees it: uploads and read-backs
};

/// Bytes that shaders read and write and commands copy. Move-only; the context outlives it.
///
/// One binding of a shader sees at most DeviceInfo::max_binding_bytes (128 MiB on lavapipe), so
/// that is the most one buffer may hold: what is larger is split by whoever knows where it may be
/// cut.
class Buffer {
 public:
  /// Errors: kInvalidArgument for 0 bytes or more than one binding sees, kUnavailable when memory
  /// is short: the driver's word, or this context's buffers would outgrow DeviceInfo::memory_bytes.
  static Result<Buffer> create(Context& context, std::uint64_t bytes, Memory memory);
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;
  ~Buffer();

  std::uint64_t bytes() const;
  /// The buffer as floats, where the host sees it (Memory::kHost); valid while no command uses it.
  std::span<float> floats();
  std::span<std::byte> mapped();

  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  explicit Buffer(std::unique_ptr<Handles> handles);
  std::unique_ptr<Handles> handles_;
};

/// A device buffer of these bytes; waits.
Result<Buffer> create_filled(Context& context, std::span<const std::byte> from);

/// Copies to or from a device buffer through a host one made for the occasion; waits.
Result<void> upload(Context& context, std::span<const std::byte> from, Buffer& to);
Result<void> download(Context& context, const Buffer& from, std::span<std::byte> to);

}  // namespace opaline::gpu
