#pragma once

#include <deque>
#include <memory>

#include "reconstruct/minimiser.h"
#include "reconstruct/vulkan/device_space.h"

namespace opaline::reconstruct::vulkan {

/// L-BFGS on DeviceObjective, all of it on the device; solves go no further than 1e-7 of their right-hand sides. What it is given outlives it.
class VulkanMinimiser final : public Minimiser {
 public:
  static Result<std::unique_ptr<VulkanMinimiser>> create(gpu::Context& context,
                                                         gpu::Commands& commands,
                                                         const Kernels& kernels,
                                                         const ModelKernels& model,
                                                         const ChannelProblem& problem,
                                                         const InverseOptions& options,
                                                         const LbfgsState& from);

  Result<StepOutcome> step(std::stop_token stop) override;
  Evaluation at() const override { return space_->at(); }
  Result<LbfgsState> state() override;
  void start_afresh() override { objective_->start_afresh(); }
  long solves() const override { return objective_->solves(); }
  const DeviceObjective& objective() const { return *objective_; }

 private:
  VulkanMinimiser(gpu::Context& context, gpu::Commands& commands) : recorder_(context, commands) {}
  Recorder recorder_;
  LbfgsOptions options_;
  std::unique_ptr<DeviceSpace> space_;
  std::unique_ptr<DeviceObjective> objective_;
  std::deque<PairProducts> products_;
};

/// The device's trouble, with what can be done about it.
Error with_remedy(Error error);

}  // namespace opaline::reconstruct::vulkan
