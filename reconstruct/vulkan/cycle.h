#pragma once

#include <vector>

#include "reconstruct/vulkan/device_fields.h"
#include "reconstruct/vulkan/kernels.h"
#include "reconstruct/vulkan/recorder.h"

namespace opaline::reconstruct::vulkan {

/// The passes of diffusion/passes.h that stay on the device, recorded: all but the residual in twice the digits, which
/// those who own b and x take where these are. What it is given outlives it.
class Cycle {
 public:
  Cycle(Recorder& recorder,
        const Kernels& kernels,
        const std::vector<diffusion::Level>& levels,
        const std::vector<DeviceLevel>& coefficients,
        DeviceFields& fields)
      : recorder_(recorder),
        kernels_(kernels),
        levels_(levels),
        coefficients_(coefficients),
        fields_(fields) {}

  int levels() const { return static_cast<int>(levels_.size()); }
  void clear();  ///< zeros in every field
  void smooth_restrict(int level);
  void prolong_smooth(int level);
  void apply_dot(bool restart);
  /// update_norm() without reading the norms.
  void update();
  /// d into x = high + low.
  void fold(gpu::Buffer& x, gpu::Buffer& x_low);
  /// r = b - K x, and the scalars kNorm and kSource.
  void residual(const gpu::Buffer& b, const gpu::Buffer& x, const gpu::Buffer& x_low);
  /// Runs what was recorded and shows the scalars: [scalar][right-hand side].
  std::span<const float> read_scalars();

 private:
  using Buffers = std::initializer_list<const gpu::Buffer*>;
  void dispatch(const gpu::Pipeline& kernel,
                Buffers buffers,
                const GridPush& push,
                std::size_t threads);
  void reduce(Scalar scalar, std::int32_t partials, std::int32_t first = 0);
  GridPush push_for(int level, int color = 0) const;
  std::size_t colored_threads(int level) const;
  std::size_t cells() const { return levels_.front().cell_count(); }

  Recorder& recorder_;
  const Kernels& kernels_;
  const std::vector<diffusion::Level>& levels_;
  const std::vector<DeviceLevel>& coefficients_;
  DeviceFields& fields_;
};

}  // namespace opaline::reconstruct::vulkan
