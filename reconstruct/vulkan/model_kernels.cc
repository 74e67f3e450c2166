#include "reconstruct/vulkan/model_kernels.h"

#include <span>

#include "reconstruct_vulkan_shaders.h"

namespace opaline::reconstruct::vulkan {
namespace {

struct Source {
  const char* name;
  std::span<const std::uint32_t> spirv;
  std::uint32_t buffers;
  std::uint32_t push_bytes;
};

constexpr std::uint32_t kModel = sizeof(ModelPush);
constexpr std::uint32_t kVectors = sizeof(VectorPush);

// In the order of ModelKernel.
std::array<Source, static_cast<std::size_t>(ModelKernel::kCount)> sources() {
  return {{{"medium", shaders::medium_comp, 2, kModel},
           {"finest", shaders::finest_comp, 4, kModel},
           {"weights", shaders::weights_comp, 4, kModel},
           {"coarsen", shaders::coarsen_comp, 6, kModel},
           {"rays", shaders::rays_comp, 2, kModel},
           {"deposit", shaders::deposit_comp, 4, kModel},
           {"observe", shaders::observe_comp, 10, kModel},
           {"adjoint_source", shaders::adjoint_source_comp, 3, kModel},
           {"gather", shaders::gather_comp, 5, kModel},
           {"rim_terms", shaders::rim_terms_comp, 5, kModel},
           {"ray_terms", shaders::ray_terms_comp, 8, kModel},
           {"camera_rays", shaders::camera_rays_comp, 7, kModel},
           {"look", shaders::look_comp, 8, kModel},
           {"ray_source", shaders::ray_source_comp, 7, kModel},
           {"ray_sums", shaders::ray_sums_comp, 8, kModel},
           {"ray_slopes", shaders::ray_slopes_comp, 6, kModel},
           {"ray_gradient", shaders::ray_gradient_comp, 7, kModel},
           {"edges", shaders::edges_comp, 4, kModel},
           {"gradient", shaders::gradient_comp, 8, kModel},
           {"combine", shaders::combine_comp, 8, kVectors},
           {"move", shaders::move_comp, 4, kVectors},
           {"pair", shaders::pair_comp, 8, kVectors},
           {"products", shaders::products_comp, 7, kVectors},
           {"block", shaders::block_comp, 2, sizeof(std::int32_t)}}};
}

}  // namespace

Result<ModelKernels> ModelKernels::create(gpu::Context& context) {
  ModelKernels kernels;
  for (const Source& s : sources()) {
    auto made = gpu::Pipeline::create_compute(context, s.name, s.spirv, {s.buffers, s.push_bytes});
    if (!made) return made.error();
    kernels.pipelines_.push_back(*std::move(made));
  }
  return kernels;
}

}  // namespace opaline::reconstruct::vulkan
