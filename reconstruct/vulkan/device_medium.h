#pragma once

#include <vector>

#include "base/block.h"
#include "reconstruct/vulkan/device_fields.h"
#include "reconstruct/vulkan/model_kernels.h"
#include "reconstruct/vulkan/recorder.h"

namespace opaline::reconstruct::vulkan {

/// Coefficients and grids of one medium, made on the device from the parameters of the minimisation: what
/// diffusion::build_levels() makes on the processor.
class DeviceMedium {
 public:
  static Result<DeviceMedium> create(gpu::Context& context, const Block& block);

  /// Records the way from p to the matrices of all grids. `push` has cells, size and surface of the block.
  void build(Recorder& recorder, const ModelKernels& kernels, const gpu::Buffer& p, ModelPush push);

  const std::vector<diffusion::Level>& shapes() const {
    return shapes_;
  }  ///< no coefficients in them
  const std::vector<DeviceLevel>& levels() const { return levels_; }
  const gpu::Buffer& coefficients() const {
    return walls_.back();
  }  ///< kappa and sigma_a of each cell

 private:
  std::vector<diffusion::Level> shapes_;
  std::vector<DeviceLevel> levels_;
  std::vector<gpu::Buffer> walls_;  // sinks and walls of each level; last: the coefficients
};

}  // namespace opaline::reconstruct::vulkan
