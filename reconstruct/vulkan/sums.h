#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/vulkan/model_kernels.h"
#include "reconstruct/vulkan/recorder.h"

namespace opaline::reconstruct::vulkan {

/// Slots of the block of sums, in reconstruct/shaders/slots.glsl.
enum Slot : std::int32_t {
  kChiSquared,
  kSmoothDiffusion,
  kSmoothAbsorption,
  kMove,
  kPromised,
  kSlope,
  kNewSlope,
  kSquare,
  kLargest,
  kOwn,
};
inline constexpr std::int32_t kProductSlots = 6;  // s.s', s.y', y.s', y.y', g~.s', g~.y'
inline constexpr std::uint32_t kSumGroups = 256;  // sums.glsl

/// The sums that kernels leave, each in twice float32's digits, and the one block that the processor reads of them.
class Sums {
 public:
  static Result<Sums> create(gpu::Context& context,
                             const ModelKernels& kernels,
                             std::int32_t slots);

  void clear(Recorder& recorder);  ///< zeros in every slot
  const gpu::Buffer& partials() const { return partials_; }
  const gpu::Buffer& block() const { return block_; }
  /// Adds up `count` slots from `first` on, into the block.
  void reduce(Recorder& recorder, std::int32_t first, std::int32_t count) const;
  /// Adds up all slots, runs what was recorded and reads the block; zeros when the device failed.
  std::vector<double> read(Recorder& recorder);

 private:
  Sums(const ModelKernels& kernels,
       std::int32_t slots,
       gpu::Buffer partials,
       gpu::Buffer block,
       gpu::Buffer on_host)
      : kernels_(&kernels),
        slots_(slots),
        partials_(std::move(partials)),
        block_(std::move(block)),
        on_host_(std::move(on_host)) {}
  const ModelKernels* kernels_;
  std::int32_t slots_;
  gpu::Buffer partials_;
  gpu::Buffer block_;
  gpu::Buffer on_host_;
};

}  // namespace opaline::reconstruct::vulkan
