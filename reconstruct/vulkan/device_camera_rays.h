#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/vulkan/device_passes.h"
#include "reconstruct/vulkan/model_kernels.h"
#include "reconstruct/vulkan/recorder.h"

namespace opaline::reconstruct::vulkan {

/// diffusion::CameraRays on the device: what the camera sees along refracted rays, its transpose and its gradient. Where
/// the rays cross the layers depends on the camera alone and is sent once; transposed sums are gathered cell by cell, so
/// that they come out the same each time.
///
/// Every push is the seen face's, with Flag::kAlongRays. Rasters are of the seen face, group after group.
class DeviceCameraRays {
 public:
  static Result<DeviceCameraRays> create(gpu::Context& context, const ChannelProblem& problem);
  static constexpr std::uint64_t kBytesOfCell = 104;  ///< of what create() allocates, at most

  /// What of the rays depends on the medium.
  void trace(Recorder& recorder,
             const ModelKernels& kernels,
             const gpu::Buffer& coefficients,
             const ModelPush& push) const;
  /// Phi of a turn's groups.
  void look(Recorder& recorder,
            const ModelKernels& kernels,
            const gpu::Buffer& irradiance,
            const DeviceSolution& fluence,
            const gpu::Buffer& seen,
            const ModelPush& push) const;
  /// b of the adjoint from r = dJ/dPhi; all of it.
  void source(Recorder& recorder,
              const ModelKernels& kernels,
              const gpu::Buffer& rims,
              const gpu::Buffer& b,
              const ModelPush& push) const;
  /// A turn's share of the sums that the gradient is made of.
  void gather(Recorder& recorder,
              const ModelKernels& kernels,
              const gpu::Buffer& irradiance,
              const gpu::Buffer& rims,
              const DeviceSolution& fluence,
              const ModelPush& push) const;
  /// Adds the gradient by kappa and sigma_a of each cell, once all turns are gathered; with surface light, which has no ray
  /// terms of its own, puts it there instead.
  void add_gradient(Recorder& recorder,
                    const ModelKernels& kernels,
                    const gpu::Buffer& coefficients,
                    const gpu::Buffer& gradient,
                    const ModelPush& push) const;

 private:
  enum Table : std::size_t {
    kTapCells,
    kTapShares,
    kLengths,
    kStarts,
    kEntries,
    kLosses,
    kShares,
    kSurface,
    kSums,
    kSlopes
  };
  const gpu::Buffer& operator[](Table table) const { return tables_[table]; }

  std::uint32_t pixel_groups_ = 0;
  std::uint32_t cell_groups_ = 0;
  std::vector<gpu::Buffer> tables_;
};

}  // namespace opaline::reconstruct::vulkan
