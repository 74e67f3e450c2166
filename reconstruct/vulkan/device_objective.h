#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/vulkan/device_camera_rays.h"
#include "reconstruct/vulkan/device_medium.h"
#include "reconstruct/vulkan/device_passes.h"
#include "reconstruct/vulkan/sums.h"

namespace opaline::reconstruct::vulkan {

/// The objective of reconstruct/objective.h with the gradient of reconstruct/gradient.h on the device, for the whole
/// parametrization and both priors: the matrices, the light, both solves, the camera, the adjoint's gradient and the prior; only scalars leave it.
///
/// Numbers are float32 but for what would lose digits: fluence and adjoint are kept, and their residual taken, in twice
/// float32's digits (device_passes.h), sums for the processor too (sums.h); no float64 is asked of the device. Light is
/// scaled by the brightest illumination, J by a power of two, so that float32's range serves any unit.
///
/// Illuminations are worked through in turns of as many groups of four as one binding and the memory hold; each turn
/// keeps its fields for the next evaluation to start from when memory allows that, and starts from darkness when not.
class DeviceObjective {
 public:
  struct Settings {
    double tolerance = 1e-5;
    double regularization = 0.0;
    Smoothness regularizer = Smoothness::kH1;
  };
  /// Plans with the memory that is left now. The problem and the kernels outlive it.
  static Result<std::unique_ptr<DeviceObjective>> create(Recorder& recorder,
                                                         const Kernels& kernels,
                                                         const ModelKernels& model,
                                                         const ChannelProblem& problem,
                                                         const Settings& settings);

  /// dJ/dp / scale() at p, and the slots kChiSquared to kSmoothAbsorption; both recorded when this returns, and run with
  /// the sums' read(). Errors: the device's, kCancelled between two outer iterations of a solve, kInternal when a solve
  /// stays far from its tolerance.
  Result<void> evaluate(const gpu::Buffer& p,
                        const gpu::Buffer& gradient,
                        const Sums& sums,
                        const std::stop_token& stop);

  double scale() const {
    return scale_;
  }  ///< J is this times what the device computes; a power of two
  void start_afresh();
  long solves() const { return solves_; }
  std::size_t turns() const { return turns_.size(); }
  bool keeps_fields() const { return keep_; }

 private:
  /// Some groups of four illuminations, and what is measured of them; the last turn is filled up with dark ones.
  struct Turn {
    int count = 0;  // illuminations
    gpu::Buffer irradiance;
    gpu::Buffer pictures;
    gpu::Buffer weights;
    gpu::Buffer rims;
  };
  struct Solutions {
    DeviceSolution fluence;
    DeviceSolution adjoint;
  };
  DeviceObjective(Recorder& recorder,
                  const Kernels& kernels,
                  const ModelKernels& model,
                  const ChannelProblem& problem,
                  const Settings& settings);
  Result<void> allocate();
  Result<void> plan();
  Result<void> add_turn(std::size_t first, double light);
  Result<void> add_solutions();
  Result<void> allocate_work();
  ModelPush push_for(Face face, std::int32_t flags) const;
  Result<void> solve(const Turn& turn, DeviceSolution& x, const std::stop_token& stop);
  Result<void> take_turn(Turn& turn,
                         Solutions& solutions,
                         std::int32_t first,
                         const Sums& sums,
                         const std::stop_token& stop);
  void record_adjoint_source(const Turn& turn, const ModelPush& seen);
  void gather(const Turn& turn, const Solutions& solutions, std::int32_t first);
  void run(ModelKernel kernel,
           std::initializer_list<const gpu::Buffer*> buffers,
           const ModelPush& push,
           std::uint32_t groups_x,
           int groups_y = 1);

  Recorder& recorder_;
  const Kernels& kernels_;
  const ModelKernels& model_;
  const ChannelProblem& problem_;
  Settings settings_;
  double scale_ = 1.0;
  int groups_ = 0;  // of a turn
  bool keep_ = false;
  long solves_ = 0;
  std::vector<DeviceMedium> medium_;             // one
  std::optional<DeviceCameraRays> camera_rays_;  // none with the surface's camera law
  std::vector<DeviceFields> fields_;             // one, for the largest turn
  std::vector<Turn> turns_;
  std::vector<Solutions> solutions_;  // one a turn, or one for all
  // b; rays; products; ray terms; the prior's weights; terms of the lit and of the seen face; camera gains
  std::vector<gpu::Buffer> work_;
};

}  // namespace opaline::reconstruct::vulkan
