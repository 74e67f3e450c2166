#pragma once

#include <memory>

#include "base/result.h"
#include "gpu/context.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/minimiser.h"

namespace opaline::reconstruct::vulkan {

struct VulkanOptions {
  gpu::ContextOptions gpu;  ///< which device computes; graphics is not needed
};

/// Multigrid-preconditioned conjugate gradients (diffusion/conjugate_gradient.h) in compute shaders: coefficients and
/// fields stay on the device in float32, four right-hand sides to a vec4; one submission an outer iteration, after
/// which the norms are read; the true residual is taken on the host in float64.
///
/// Right-hand sides that one binding of the device cannot hold together (128 MiB on lavapipe) are solved in turns. One
/// right-hand side costs as much as four.
///
/// Errors: kUnavailable without a device that will do (with the reason for each), when the device is lost or its memory
///         does not hold the block, each with what can be done; kTimeout when the device hangs. After kUnavailable or
///         kTimeout make a new solver.
Result<std::unique_ptr<diffusion::FluenceSolver>> make_vulkan_solver(const VulkanOptions& options);

/// A solver, and the same device as an engine for whole minimisations by L-BFGS (vulkan_minimiser.h), which lives in the
/// solver: solve, adjoint, gradient, objective and line search stay on the device, and between two submissions one block
/// of scalars is read. One of the two works at a time.
struct VulkanBackEnd {
  std::unique_ptr<diffusion::FluenceSolver> solver;
  InversionEngine* engine = nullptr;
};
Result<VulkanBackEnd> make_vulkan_back_end(const VulkanOptions& options);

/// The part of automatic choice: whether a Vulkan device is here that is not a CPU in disguise.
bool real_gpu_available();

}  // namespace opaline::reconstruct::vulkan
