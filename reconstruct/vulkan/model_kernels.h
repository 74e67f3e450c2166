#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gpu/context.h"
#include "gpu/pipeline.h"

namespace opaline::reconstruct::vulkan {

/// Push constants of the objective's kernels: reconstruct/shaders/model.glsl.
struct ModelPush {
  std::array<std::int32_t, 4> cells{};
  std::array<std::int32_t, 4> coarse{};
  std::array<std::int32_t, 4> ratio{1, 1, 1, 0};  ///< last: flags
  std::array<std::int32_t, 4> face{};             ///< face, groups, seen face
  std::array<float, 4> size{};
  std::array<float, 4> surface{};
  std::array<float, 4> smoothness{};
};

enum Flag : std::int32_t {
  kCollimated = 1,
  kCentroid = 2,
  kLit = 4,
  kSeen = 8,
  kFirst = 16,
  kAlongRays = 32
};

/// Push constants of the minimisation's kernels: reconstruct/shaders/vectors.glsl.
struct VectorPush {
  std::array<std::int32_t, 4>
      size{};  ///< parameters, cells, whether the direction starts, first slot
  std::array<float, 4> bounds{};
  std::array<float, 4> factors{};
  std::array<float, 4> step{};  ///< factor of g~, alpha, largest move
};

enum class ModelKernel : std::uint8_t {
  kMedium,
  kFinest,
  kWeights,
  kCoarsen,
  kRays,
  kDeposit,
  kObserve,
  kAdjointSource,
  kGather,
  kRimTerms,
  kRayTerms,
  kCameraRays,
  kLook,
  kRaySource,
  kRaySums,
  kRaySlopes,
  kRayGradient,
  kEdges,
  kGradient,
  kCombine,
  kMove,
  kPair,
  kProducts,
  kBlock,
  kCount
};

/// The compiled shaders of a whole minimisation.
class ModelKernels {
 public:
  static Result<ModelKernels> create(gpu::Context& context);
  const gpu::Pipeline& operator[](ModelKernel kernel) const {
    return pipelines_[static_cast<std::size_t>(kernel)];
  }

 private:
  std::vector<gpu::Pipeline> pipelines_;
};

}  // namespace opaline::reconstruct::vulkan
