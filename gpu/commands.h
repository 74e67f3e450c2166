#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>

#include "base/result.h"
#include "gpu/buffer.h"
#include "gpu/image.h"
#include "gpu/pipeline.h"

namespace opaline::gpu {

/// What shaders are given for one dispatch or draw.
struct Arguments {
  std::span<const Buffer* const> buffers;  ///< one for each binding of the pipeline's interface
  std::span<const std::byte> push;         ///< exactly its push constants
};

/// Push constants from a plain struct: commands.dispatch(kernel, {buffers, push_of(constants)},
/// groups).
template <class T>
std::span<const std::byte> push_of(const T& constants) {
  return std::as_bytes(std::span(&constants, 1));
}

/// A list of commands: recorded once, run as often as one likes. Move-only; the context outlives
/// it.
///
/// Commands start in the order of recording but may overlap; one that reads what another wrote
/// needs a barrier() between. Everything used must outlive the runs.
class Commands {
 public:
  static Result<Commands> create(Context& context);
  Commands(Commands&&) noexcept;
  Commands& operator=(Commands&&) noexcept;
  ~Commands();

  /// Forgets what was recorded and starts again.
  Result<void> begin();
  Result<void> end();

  void dispatch(const Pipeline& kernel,
                const Arguments& arguments,
                std::array<std::uint32_t, 3> groups);
  /// Clears the target to zeros and draws into it.
  void draw(const Pipeline& raster,
            const Arguments& arguments,
            std::uint32_t vertices,
            RenderTarget& target);
  /// The same of triangles whose corners are numbered in `indices`, 32 bits each; what was drawn before stays where
  /// `clear` is false.
  struct Indexed {
    const Buffer& indices;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  void draw(const Pipeline& raster,
            const Arguments& arguments,
            const Indexed& triangles,
            RenderTarget& target,
            bool clear);
  /// The target's colour as rows of RGBA floats, top row first. Waits for the draw.
  void copy_color(const RenderTarget& from, Buffer& to);
  /// The depth of a target without colour as rows of floats, from a byte of the buffer on.
  void copy_depth(const RenderTarget& from, Buffer& to, std::uint64_t first_byte = 0);
  void copy(const Buffer& from, Buffer& to, std::uint64_t bytes);
  void fill_zero(Buffer& buffer);
  /// Whatever was recorded before is done, and seen by whatever comes after and by the host when
  /// the run is over.
  void barrier();

  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  void begin_drawing(const Pipeline& raster,
                     const Arguments& arguments,
                     RenderTarget& target,
                     bool clear);
  explicit Commands(std::unique_ptr<Handles> handles);
  std::unique_ptr<Handles> handles_;
};

}  // namespace opaline::gpu
