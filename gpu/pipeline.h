#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "base/result.h"

namespace opaline::gpu {

class Context;

/// What a shader sees: buffers at bindings 0 to buffers - 1 of set 0, the first `uniforms` of them uniform (every device
/// allows 16384 bytes) and the rest storage, and a block of push constants.
struct Interface {
  std::uint32_t buffers = 0;
  std::uint32_t push_bytes = 0;  ///< a multiple of 4; every device allows 128
  std::uint32_t uniforms = 0;
};

/// Which triangles are drawn: all, or those whose corners run anticlockwise as the picture shows them.
enum class Sides : std::uint8_t { kBoth, kFront };

/// A compiled shader program with its interface. Move-only; the context outlives it.
class Pipeline {
 public:
  /// A compute kernel; `constants` are the shader's specialisation constants 0, 1, ...
  static Result<Pipeline> create_compute(Context& context,
                                         std::string_view name,
                                         std::span<const std::uint32_t> spirv,
                                         const Interface& interface,
                                         std::span<const std::uint32_t> constants = {});
  /// Draws triangle lists whose vertices the vertex shader makes from gl_VertexIndex and its
  /// buffers, into a RenderTarget, the nearest kept: depth runs from 1 at the near
  /// plane to 0 far away.
  static Result<Pipeline> create_raster(Context& context,
                                        std::string_view name,
                                        std::span<const std::uint32_t> vertex_spirv,
                                        std::span<const std::uint32_t> fragment_spirv,
                                        const Interface& interface,
                                        Sides sides = Sides::kBoth);
  /// The same into a target that has only depth; there is no fragment shader.
  static Result<Pipeline> create_depth(Context& context,
                                       std::string_view name,
                                       std::span<const std::uint32_t> vertex_spirv,
                                       const Interface& interface);
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  ~Pipeline();

  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  explicit Pipeline(std::unique_ptr<Handles> handles);
  std::unique_ptr<Handles> handles_;
};

}  // namespace opaline::gpu
