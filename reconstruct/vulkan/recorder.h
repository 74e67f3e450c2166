#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>

#include "gpu/commands.h"
#include "gpu/context.h"

namespace opaline::reconstruct::vulkan {

/// Records dispatches one after another, each seeing what those before it wrote, and runs them when asked. The first
/// failure is kept; what comes after does nothing. What it is given outlives it.
class Recorder {
 public:
  Recorder(gpu::Context& context, gpu::Commands& commands)
      : context_(context), commands_(commands) {}

  void dispatch(const gpu::Pipeline& kernel,
                std::initializer_list<const gpu::Buffer*> buffers,
                std::span<const std::byte> push,
                std::array<std::uint32_t, 3> groups);
  void copy(const gpu::Buffer& from, gpu::Buffer& to);  ///< all of `from`
  void fill_zero(gpu::Buffer& buffer);
  /// Copies or clears do not wait for one another; this ends a run of them.
  void barrier();
  /// Submits what was recorded and waits for it.
  void finish();
  void fail(const Error& error);

  const std::optional<Error>& error() const { return error_; }
  gpu::Context& context() { return context_; }

 private:
  bool start();
  gpu::Context& context_;
  gpu::Commands& commands_;
  bool recording_ = false;
  std::optional<Error> error_;
};

}  // namespace opaline::reconstruct::vulkan
