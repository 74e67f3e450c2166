#include "reconstruct/vulkan/sums.h"

namespace opaline::reconstruct::vulkan {
namespace {

constexpr std::uint64_t kPair = 8;  // bytes: high and low part

}  // namespace

Result<Sums> Sums::create(gpu::Context& context, const ModelKernels& kernels, std::int32_t slots) {
  auto partials = gpu::Buffer::create(context, kPair * slots * kSumGroups, gpu::Memory::kDevice);
  if (!partials) return partials.error();
  auto block = gpu::Buffer::create(context, kPair * slots, gpu::Memory::kDevice);
  if (!block) return block.error();
  auto on_host = gpu::Buffer::create(context, kPair * slots, gpu::Memory::kHost);
  if (!on_host) return on_host.error();
  return Sums(kernels, slots, *std::move(partials), *std::move(block), *std::move(on_host));
}

void Sums::clear(Recorder& recorder) {
  recorder.fill_zero(partials_);
  recorder.fill_zero(block_);
}

void Sums::reduce(Recorder& recorder, std::int32_t first, std::int32_t count) const {
  recorder.dispatch((*kernels_)[ModelKernel::kBlock],
                    {&partials_, &block_},
                    gpu::push_of(first),
                    {static_cast<std::uint32_t>(count), 1, 1});
}

std::vector<double> Sums::read(Recorder& recorder) {
  reduce(recorder, 0, slots_);
  recorder.copy(block_, on_host_);
  recorder.barrier();
  recorder.finish();
  std::vector<double> values(static_cast<std::size_t>(slots_), 0.0);
  if (recorder.error()) return values;
  const std::span<const float> pairs = on_host_.floats();
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<double>(pairs[2 * i]) + static_cast<double>(pairs[2 * i + 1]);
  return values;
}

}  // namespace opaline::reconstruct::vulkan
