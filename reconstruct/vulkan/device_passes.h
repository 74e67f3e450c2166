#pragma once

#include <span>
#include <vector>

#include "reconstruct/vulkan/cycle.h"

namespace opaline::reconstruct::vulkan {

/// A field in twice float32's digits, x = high + low, for some groups of four right-hand sides.
struct DeviceSolution {
  gpu::Buffer high;
  gpu::Buffer low;

  static Result<DeviceSolution> create(gpu::Context& context, std::size_t cells, int groups);
  void clear(Recorder& recorder);
};

/// The passes of diffusion/passes.h with b and x on the device too: x in twice float32's digits, the residual taken with
/// differences first, so that no float64 is needed. One submission an outer iteration, after which the norms are read.
/// When the device fails, norms are NaN, later passes do nothing, and the recorder's error() says why.
class DevicePasses {
 public:
  DevicePasses(Recorder& recorder,
               Cycle& cycle,
               const DeviceFields& fields,
               const gpu::Buffer& b,
               DeviceSolution& x,
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
  /// ||b||^2 of each right-hand side, once true_residual() has been called.
  std::span<const double> b_norms() const { return b_norms_; }

 private:
  void take_residual();
  std::span<const double> read_norms();

  Recorder& recorder_;
  Cycle& cycle_;
  const DeviceFields& fields_;
  const gpu::Buffer& b_;
  DeviceSolution& x_;
  std::vector<double> norms_;
  std::vector<double> b_norms_;
};

}  // namespace opaline::reconstruct::vulkan
