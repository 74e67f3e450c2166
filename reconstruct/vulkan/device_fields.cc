#include "reconstruct/vulkan/device_fields.h"

#include <algorithm>
#include <array>
#include <span>
#include <tuple>

#include "reconstruct/vulkan/kernels.h"

namespace opaline::reconstruct::vulkan {
namespace {

using diffusion::Level;
using Vec4s = std::vector<std::array<float, 4>>;

constexpr std::uint64_t kVec4 = 16;  // bytes

/// Conductances to the neighbours before (or after) each cell along the three axes.
Vec4s conductances(const Level& level, bool after) {
  Vec4s packed(level.cell_count());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t stride = level.stride(static_cast<int>(axis));
    const auto n = static_cast<std::size_t>(level.cells[axis]);
    for (std::size_t c = 0; c < packed.size(); ++c) {
      const bool first = c / stride % n == 0;
      const double g = after   ? level.conductance[axis][c]
                       : first ? 0.0
                               : level.conductance[axis][c - stride];
      packed[c][axis] = static_cast<float>(g);
    }
  }
  return packed;
}

/// c = D - sum g: what a cell loses to absorption and through the surface.
Vec4s high_of(const Level& level) {
  Vec4s packed = conductances(level, true);
  for (std::size_t c = 0; c < packed.size(); ++c) {
    double own = level.diagonal[c];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t stride = level.stride(static_cast<int>(axis));
      own -= level.conductance[axis][c];
      if (c / stride % level.cells[axis] != 0) own -= level.conductance[axis][c - stride];
    }
    packed[c][3] = static_cast<float>(own);
  }
  return packed;
}

Vec4s low_of(const Level& level) {
  Vec4s packed = conductances(level, false);
  for (std::size_t c = 0; c < packed.size(); ++c)
    packed[c][3] = static_cast<float>(level.diagonal[c]);
  return packed;
}

Vec4s transfer_of(const Level& level) {
  Vec4s packed(level.cell_count());
  for (std::size_t c = 0; c < packed.size(); ++c) {
    double own = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double w = level.transfer[axis].empty() ? 0.0 : level.transfer[axis][c];
      packed[c][axis] = static_cast<float>(w);
      own -= w;
    }
    packed[c][3] = static_cast<float>(own);
  }
  return packed;
}

Result<gpu::Buffer> send(gpu::Context& context, const Vec4s& values) {
  const auto bytes = std::as_bytes(std::span(values));
  auto buffer = gpu::Buffer::create(context, bytes.size(), gpu::Memory::kDevice);
  if (!buffer) return buffer;
  if (auto sent = gpu::upload(context, bytes, *buffer); !sent) return sent.error();
  return buffer;
}

/// Adds a buffer to a list, unless an earlier one failed.
Result<void> add(gpu::Context& context,
                 std::uint64_t bytes,
                 gpu::Memory memory,
                 std::vector<gpu::Buffer>& list) {
  auto buffer = gpu::Buffer::create(context, bytes, memory);
  if (!buffer) return buffer.error();
  list.push_back(*std::move(buffer));
  return ok();
}

/// Partial sums of a group: two a workgroup, where sweep.comp writes those of both colours and residual.comp both of its
/// sums.
std::uint64_t partial_count(const Level& finest) {
  const std::size_t half_rows =
      static_cast<std::size_t>((finest.cells[0] + 1) / 2) * finest.cells[1] * finest.cells[2];
  return std::uint64_t{2} * std::max(workgroups(finest.cell_count()), workgroups(half_rows));
}

}  // namespace

Result<DeviceLevel> DeviceLevel::create(gpu::Context& context, const Level& level) {
  auto low = send(context, low_of(level));
  if (!low) return low.error();
  auto high = send(context, high_of(level));
  if (!high) return high.error();
  auto transfer = send(context, transfer_of(level));
  if (!transfer) return transfer.error();
  return DeviceLevel{*std::move(low), *std::move(high), *std::move(transfer)};
}

Result<DeviceLevel> DeviceLevel::allocate(gpu::Context& context, std::size_t cells) {
  std::vector<gpu::Buffer> made;
  for (int i = 0; i < 3; ++i)
    if (auto added = add(context, kVec4 * cells, gpu::Memory::kDevice, made); !added)
      return added.error();
  return DeviceLevel{std::move(made[0]), std::move(made[1]), std::move(made[2])};
}

Result<DeviceFields> DeviceFields::create(gpu::Context& context,
                                          const std::vector<Level>& levels,
                                          int groups,
                                          Staging staging) {
  DeviceFields f;
  f.groups = groups;
  const std::size_t cells = levels.front().cell_count();
  const std::uint64_t vec4s = kVec4 * groups;
  using gpu::Memory;
  for (const Level& level : levels)
    for (auto* list : {&f.r, &f.z})
      if (auto made = add(context, vec4s * level.cell_count(), Memory::kDevice, *list); !made)
        return made.error();
  for (int i = 0; i < 3; ++i)
    if (auto made = add(context, vec4s * cells, Memory::kDevice, f.finest); !made)
      return made.error();
  for (const auto& [bytes, memory, list] :
       {std::tuple(vec4s * partial_count(levels.front()), Memory::kDevice, &f.sums),
        std::tuple(vec4s * kScalarCount, Memory::kDevice, &f.sums),
        std::tuple(vec4s * kScalarCount, Memory::kHost, &f.host)})
    if (auto made = add(context, bytes, memory, *list); !made) return made.error();
  if (staging == Staging::kNone) return f;
  if (auto made = add(context, vec4s * cells, Memory::kHost, f.host); !made) return made.error();
  return f;
}

int groups_that_fit(const gpu::DeviceInfo& device, std::size_t cells) {
  const std::uint64_t field = kVec4 * cells;
  if (workgroups(cells) > device.max_groups_x) return 0;
  const std::uint64_t by_binding =
      std::min(device.max_binding_bytes, device.max_allocation_bytes) / field;
  const std::uint64_t coefficients = 3 * field * 8 / 7;  // of all levels: 1 + 1/8 + 1/64 + ...
  const std::uint64_t memory = device.memory_bytes / 10 * 9;
  if (memory < coefficients) return 0;
  const std::uint64_t one_group = 7 * field;  // r, z of all levels, p, q, d and the staging field
  const std::uint64_t by_memory = (memory - coefficients) / one_group;
  return static_cast<int>(std::min<std::uint64_t>({by_binding, by_memory, 1024}));
}

}  // namespace opaline::reconstruct::vulkan
