#pragma once

#include <optional>
#include <span>
#include <vector>

#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/vulkan/cycle.h"

namespace opaline::reconstruct::vulkan {

/// The passes of diffusion/passes.h on a Vulkan device, for right-hand sides first to first + count of a batch.
///
/// Passes are recorded; update_norm() submits what was recorded since the last submission, one outer iteration, and
/// reads the norms. Each right-hand side is scaled by the norm of its first residual, so that float32 sums of squares
/// keep clear of underflow. When the device fails, norms are NaN, later passes do nothing, and error() says why.
class VulkanPasses {
 public:
  /// What the device holds; all of it outlives the passes.
  struct Device {
    gpu::Context& context;
    const Kernels& kernels;
    const std::vector<diffusion::Level>& levels;  ///< on the host, in float64
    const std::vector<DeviceLevel>& coefficients;
    DeviceFields& fields;
    gpu::Commands& commands;
  };
  VulkanPasses(const Device& device,
               const diffusion::FieldBatch& b,
               diffusion::FieldBatch& x,
               int first,
               int count);

  int levels() const { return cycle_.levels(); }
  std::span<const double> true_residual();
  std::span<const double> true_norm() { return true_residual(); }
  double finishing() const { return 1.0; }
  double trusted_fall() const { return 1e-5; }
  void smooth_restrict(int level) { cycle_.smooth_restrict(level); }
  void prolong_smooth(int level) { cycle_.prolong_smooth(level); }
  void apply_dot(bool restart) { cycle_.apply_dot(restart); }
  std::span<const double> update_norm();

  const std::optional<Error>& error() const { return recorder_.error(); }
  /// A field of one right-hand side as it stands on the device, unscaled.
  std::vector<double> read(const gpu::Buffer& field, int m);

 private:
  void fetch_correction();
  void send_residual(const std::vector<std::vector<double>>& residuals);
  std::span<const double> not_a_number();

  Device device_;
  Recorder recorder_;
  Cycle cycle_;
  const diffusion::FieldBatch& b_;
  diffusion::FieldBatch& x_;
  int first_;
  std::size_t cells_;
  std::vector<double> scale_;
  std::vector<double> norms_;
  bool corrected_ = false;  // d may differ from zero
};

}  // namespace opaline::reconstruct::vulkan
