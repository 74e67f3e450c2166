#include "reconstruct/vulkan/device_medium.h"

#include <algorithm>

#include "reconstruct/vulkan/kernels.h"

namespace opaline::reconstruct::vulkan {
namespace {

using diffusion::Level;

/// The grids of a block: their shapes do not depend on the coefficients.
std::vector<Level> shapes_of(const Block& block) {
  const std::size_t cells = block.cell_count();
  std::vector<Level> levels = diffusion::build_levels(
      {block, std::vector<double>(cells, 1.0), std::vector<double>(cells, 1.0), 1.0});
  for (Level& level : levels) {
    level.diagonal = {};
    level.conductance = {};
    level.transfer = {};
  }
  return levels;
}

std::uint64_t wall_floats(const Level& level) {
  const std::uint64_t cells = level.cell_count();
  std::uint64_t count = cells;
  for (const int n : level.cells) count += 2 * (cells / n);
  return count;
}

void set_cells(std::array<std::int32_t, 4>& push, const Level& level) {
  std::ranges::copy(level.cells, push.begin());
  push[3] = static_cast<std::int32_t>(level.cell_count());
}

}  // namespace

Result<DeviceMedium> DeviceMedium::create(gpu::Context& context, const Block& block) {
  DeviceMedium medium;
  medium.shapes_ = shapes_of(block);
  for (const Level& level : medium.shapes_) {
    auto made = DeviceLevel::allocate(context, level.cell_count());
    if (!made) return made.error();
    medium.levels_.push_back(*std::move(made));
    auto walls = gpu::Buffer::create(context, 4 * wall_floats(level), gpu::Memory::kDevice);
    if (!walls) return walls.error();
    medium.walls_.push_back(*std::move(walls));
  }
  auto coefficients = gpu::Buffer::create(context, 8 * block.cell_count(), gpu::Memory::kDevice);
  if (!coefficients) return coefficients.error();
  medium.walls_.push_back(*std::move(coefficients));
  return medium;
}

void DeviceMedium::build(Recorder& recorder,
                         const ModelKernels& kernels,
                         const gpu::Buffer& p,
                         ModelPush push) {
  const auto run = [&](ModelKernel kernel,
                       std::initializer_list<const gpu::Buffer*> buffers,
                       std::int32_t threads) {
    recorder.dispatch(kernels[kernel], buffers, gpu::push_of(push), {workgroups(threads), 1, 1});
  };
  set_cells(push.cells, shapes_[0]);
  const std::int32_t cells = push.cells[3];
  run(ModelKernel::kMedium, {&p, &coefficients()}, cells);
  run(ModelKernel::kFinest,
      {&coefficients(), &levels_[0].low, &levels_[0].high, &walls_[0]},
      cells);
  for (std::size_t l = 0; l + 1 < shapes_.size(); ++l) {
    set_cells(push.cells, shapes_[l]);
    set_cells(push.coarse, shapes_[l + 1]);
    std::ranges::copy(shapes_[l].ratio, push.ratio.begin());
    const DeviceLevel& fine = levels_[l];
    const DeviceLevel& coarse = levels_[l + 1];
    run(ModelKernel::kWeights, {&fine.low, &fine.high, &walls_[l], &fine.transfer}, push.cells[3]);
    run(ModelKernel::kCoarsen,
        {&fine.low, &fine.high, &walls_[l], &coarse.low, &coarse.high, &walls_[l + 1]},
        push.coarse[3]);
  }
}

}  // namespace opaline::reconstruct::vulkan
