#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpu/buffer.h"
#include "gpu/context.h"
#include "reconstruct/diffusion/multigrid.h"

namespace opaline::reconstruct::vulkan {

inline constexpr int kLanes = 4;  // right-hand sides to a vec4

/// The coefficients of one level on the device, a vec4 a cell each.
struct DeviceLevel {
  gpu::Buffer low;       ///< g to the cells before along x, y, z; D
  gpu::Buffer high;      ///< g to the cells after along x, y, z; D - sum g
  gpu::Buffer transfer;  ///< w along x, y, z; 1 - their sum

  static Result<DeviceLevel> create(gpu::Context& context, const diffusion::Level& level);
  static Result<DeviceLevel> allocate(gpu::Context& context, std::size_t cells);
};

/// Whether fields come with one that the host sees, to send and to fetch them.
enum class Staging : std::uint8_t { kNone, kField };

/// The fields of diffusion/passes.h for some groups of four right-hand sides, in float32.
struct DeviceFields {
  int groups = 0;
  std::vector<gpu::Buffer> r;  ///< one a level
  std::vector<gpu::Buffer> z;
  std::vector<gpu::Buffer> finest;  ///< p, q, d
  std::vector<gpu::Buffer> sums;    ///< partial sums, scalars
  std::vector<gpu::Buffer>
      host;  ///< the scalars, and where asked for a field, where the host sees them

  gpu::Buffer& p() { return finest[0]; }
  gpu::Buffer& q() { return finest[1]; }
  gpu::Buffer& d() { return finest[2]; }
  gpu::Buffer& partials() { return sums[0]; }
  gpu::Buffer& scalars() { return sums[1]; }
  gpu::Buffer& scalars_on_host() { return host[0]; }
  gpu::Buffer& staging() { return host[1]; }

  static Result<DeviceFields> create(gpu::Context& context,
                                     const std::vector<diffusion::Level>& levels,
                                     int groups,
                                     Staging staging);
};

/// How many groups of four right-hand sides fit the device's bindings and memory at once; 0 when not even one does.
int groups_that_fit(const gpu::DeviceInfo& device, std::size_t cells);

}  // namespace opaline::reconstruct::vulkan
