#include "reconstruct/vulkan/kernels.h"

#include <optional>
#include <vector>

#include "reconstruct_vulkan_shaders.h"

namespace opaline::reconstruct::vulkan {
namespace {

/// Makes pipelines until one fails, so that a list of them needs one check.
class Compiler {
 public:
  explicit Compiler(gpu::Context& context) : context_(context) {}

  void add(const char* name, std::span<const std::uint32_t> spirv, std::uint32_t buffers) {
    if (error_) return;
    auto made = gpu::Pipeline::create_compute(context_, name, spirv, {buffers, sizeof(GridPush)});
    if (made)
      pipelines_.push_back(*std::move(made));
    else
      error_ = made.error();
  }
  const std::optional<Error>& error() const { return error_; }
  gpu::Pipeline next() { return std::move(pipelines_[taken_++]); }

 private:
  gpu::Context& context_;
  std::vector<gpu::Pipeline> pipelines_;
  std::size_t taken_ = 0;
  std::optional<Error> error_;
};

}  // namespace

Result<Kernels> Kernels::create(gpu::Context& context) {
  Compiler compiler(context);
  compiler.add("forward_black", shaders::forward_black_comp, 4);
  compiler.add("residual_red", shaders::residual_red_comp, 3);
  compiler.add("restrict", shaders::restrict_comp, 3);
  compiler.add("prolong_red", shaders::prolong_red_comp, 5);
  compiler.add("sweep", shaders::sweep_comp, 5);
  compiler.add("direction", shaders::direction_comp, 3);
  compiler.add("apply", shaders::apply_comp, 5);
  compiler.add("update", shaders::update_comp, 6);
  compiler.add("reduce", shaders::reduce_comp, 2);
  compiler.add("fold", shaders::fold_comp, 3);
  compiler.add("residual", shaders::residual_comp, 7);
  if (compiler.error()) return *compiler.error();
  return Kernels{compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next(),
                 compiler.next()};
}

}  // namespace opaline::reconstruct::vulkan
