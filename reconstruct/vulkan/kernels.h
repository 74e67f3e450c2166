#pragma once

#include <array>
#include <cstdint>

#include "gpu/context.h"
#include "gpu/pipeline.h"

namespace opaline::reconstruct::vulkan {

/// Push constants of every kernel: reconstruct/shaders/grid.glsl.
struct GridPush {
  std::array<std::int32_t, 4> cells{};
  std::array<std::int32_t, 4> coarse{};
  std::array<std::int32_t, 4> ratio{};    ///< last: colour, or the scalar that reduce.comp writes
  std::array<std::int32_t, 4> partial{};  ///< first, count of a group, restart, groups
};

inline constexpr std::uint32_t kWorkgroup = 128;  // grid.glsl
constexpr std::uint32_t workgroups(std::size_t threads) {
  return static_cast<std::uint32_t>((threads + kWorkgroup - 1) / kWorkgroup);
}

enum Scalar : std::int32_t {
  kRho,
  kRhoBefore,
  kGamma,
  kNorm,
  kSource,
  kScalarCount
};  // scalars.glsl

/// The compiled shaders of reconstruct/shaders/.
struct Kernels {
  gpu::Pipeline forward_black;
  gpu::Pipeline residual_red;
  gpu::Pipeline restrict_residual;
  gpu::Pipeline prolong_red;
  gpu::Pipeline sweep;
  gpu::Pipeline direction;
  gpu::Pipeline apply;
  gpu::Pipeline update;
  gpu::Pipeline reduce;
  gpu::Pipeline fold;
  gpu::Pipeline residual;

  static Result<Kernels> create(gpu::Context& context);
};

}  // namespace opaline::reconstruct::vulkan
