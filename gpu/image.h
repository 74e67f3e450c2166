#pragma once

#include <cstdint>
#include <memory>

#include "base/result.h"

namespace opaline::gpu {

class Context;

/// What triangles are drawn into: R32G32B32A32_SFLOAT colour, where it has any, and D32_SFLOAT depth of one size.
/// Move-only; the context outlives it.
class RenderTarget {
 public:
  /// Errors: kInvalidArgument for a size the device cannot draw, kUnavailable when memory is short.
  static Result<RenderTarget> create(Context& context, std::uint32_t width, std::uint32_t height);
  /// One without colour: what a light sees.
  static Result<RenderTarget> create_depth(Context& context,
                                           std::uint32_t width,
                                           std::uint32_t height);
  RenderTarget(RenderTarget&&) noexcept;
  RenderTarget& operator=(RenderTarget&&) noexcept;
  ~RenderTarget();

  std::uint32_t width() const;
  std::uint32_t height() const;
  std::uint64_t color_bytes() const { return std::uint64_t{16} * width() * height(); }
  std::uint64_t depth_bytes() const { return std::uint64_t{4} * width() * height(); }

  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  explicit RenderTarget(std::unique_ptr<Handles> handles);
  static Result<RenderTarget> made(Context& context,
                                   std::uint32_t width,
                                   std::uint32_t height,
                                   bool with_color);
  std::unique_ptr<Handles> handles_;
};

}  // namespace opaline::gpu
