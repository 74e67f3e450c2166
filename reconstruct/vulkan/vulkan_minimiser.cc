#include "reconstruct/vulkan/vulkan_minimiser.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/fallback_solver.h"

namespace opaline::reconstruct::vulkan {
namespace {

constexpr double kReachable = 1e-7;  // of a residual, in pairs of float32: device_passes.h

LogBounds bounds_of(const InverseOptions& o) {
  const auto log = [](double v) { return static_cast<float>(std::log(v)); };
  return {log(o.reduced_scattering.lowest),
          log(o.reduced_scattering.highest),
          log(o.absorption.lowest),
          log(o.absorption.highest)};
}

}  // namespace

Error with_remedy(Error error) {
  if (is_device_failure(error)) error.message += "; back_end = \"host\" needs no GPU";
  return error.in("vulkan");
}

Result<std::unique_ptr<VulkanMinimiser>> VulkanMinimiser::create(gpu::Context& context,
                                                                 gpu::Commands& commands,
                                                                 const Kernels& kernels,
                                                                 const ModelKernels& model,
                                                                 const ChannelProblem& problem,
                                                                 const InverseOptions& options,
                                                                 const LbfgsState& from) {
  std::unique_ptr<VulkanMinimiser> made(new VulkanMinimiser(context, commands));
  auto space = DeviceSpace::create(made->recorder_,
                                   model,
                                   problem.block.cell_count(),
                                   bounds_of(options),
                                   made->options_.memory);
  if (!space) return space.error();
  made->space_ = *std::move(space);
  auto objective = DeviceObjective::create(
      made->recorder_,
      kernels,
      model,
      problem,
      {std::max(options.tolerance, kReachable), options.regularization, options.regularizer});
  if (!objective) return objective.error();
  made->objective_ = *std::move(objective);
  auto loaded = made->space_->load(from, *made->objective_, made->products_);
  if (!loaded) return loaded.error();
  return made;
}

Result<StepOutcome> VulkanMinimiser::step(std::stop_token stop) {
  auto outcome = lbfgs_step(*space_, products_, options_, stop);
  if (!outcome && outcome.error().code != ErrorCode::kCancelled)
    return with_remedy(outcome.error());
  return outcome;
}

Result<LbfgsState> VulkanMinimiser::state() {
  auto state = space_->state();
  if (!state) return with_remedy(state.error());
  return state;
}

}  // namespace opaline::reconstruct::vulkan
