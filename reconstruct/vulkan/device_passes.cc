#include "reconstruct/vulkan/device_passes.h"

#include <algorithm>
#include <limits>

namespace opaline::reconstruct::vulkan {

Result<DeviceSolution> DeviceSolution::create(gpu::Context& context,
                                              std::size_t cells,
                                              int groups) {
  const std::uint64_t bytes = std::uint64_t{16} * cells * groups;
  auto high = gpu::Buffer::create(context, bytes, gpu::Memory::kDevice);
  if (!high) return high.error();
  auto low = gpu::Buffer::create(context, bytes, gpu::Memory::kDevice);
  if (!low) return low.error();
  return DeviceSolution{*std::move(high), *std::move(low)};
}

void DeviceSolution::clear(Recorder& recorder) {
  recorder.fill_zero(high);
  recorder.fill_zero(low);
  recorder.barrier();
}

DevicePasses::DevicePasses(Recorder& recorder,
                           Cycle& cycle,
                           const DeviceFields& fields,
                           const gpu::Buffer& b,
                           DeviceSolution& x,
                           int count)
    : recorder_(recorder),
      cycle_(cycle),
      fields_(fields),
      b_(b),
      x_(x),
      norms_(static_cast<std::size_t>(count)),
      b_norms_(static_cast<std::size_t>(count)) {
  cycle_.clear();
}

std::span<const double> DevicePasses::read_norms() {
  const std::span<const float> scalars = cycle_.read_scalars();
  if (recorder_.error()) {
    std::ranges::fill(norms_, std::numeric_limits<double>::quiet_NaN());
    return norms_;
  }
  const std::size_t stride = static_cast<std::size_t>(fields_.groups) * kLanes;
  for (std::size_t m = 0; m < norms_.size(); ++m) {
    norms_[m] = scalars[kNorm * stride + m];
    b_norms_[m] = scalars[kSource * stride + m];
  }
  return norms_;
}

void DevicePasses::take_residual() {
  cycle_.fold(x_.high, x_.low);
  cycle_.residual(b_, x_.high, x_.low);
  read_norms();
}

std::span<const double> DevicePasses::true_residual() {
  take_residual();
  const auto dark = [&](std::size_t m) { return b_norms_[m] == 0.0 && norms_[m] != 0.0; };
  for (std::size_t m = 0; m < norms_.size() && !recorder_.error(); ++m) {
    if (!dark(m)) continue;
    x_.clear(
        recorder_);  // a right-hand side that went dark starts from darkness, and the others with it
    take_residual();
    break;
  }
  return norms_;
}

std::span<const double> DevicePasses::update_norm() {
  cycle_.update();
  return read_norms();
}

}  // namespace opaline::reconstruct::vulkan
