#include "reconstruct/vulkan/device_camera_rays.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/diffusion/camera_rays.h"
#include "reconstruct/diffusion/face_step.h"

namespace opaline::reconstruct::vulkan {
namespace {

/// Where the rays cross the layers, and the same by cell: shaders/camera_path.glsl.
struct Crossings {
  std::vector<std::int32_t> cells;
  std::vector<float> shares;  // two a sample
  std::vector<float> lengths;
  std::vector<std::int32_t> starts;
  std::vector<std::int32_t> entries;
};

struct Tap {
  int cell = 0;  // along one axis of the raster
  float share = 0.0F;
};

Tap tap(double position, int count) {
  const double at = std::clamp(position, 0.0, count - 1.0);
  const int first = std::clamp(static_cast<int>(at), 0, std::max(0, count - 2));
  return {first, static_cast<float>(at - first)};
}

void add_layer(const ChannelProblem& problem, int layer, Crossings& c) {
  const Block& block = problem.block;
  const Face face = problem.seen_face;
  const auto axis = static_cast<std::size_t>(axis_of(face));
  const auto h = block.spacing();
  const double depth = (layer + 0.5) * h[axis];
  std::size_t x = 0;
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int column = 0; column < block.face_width(face); ++column, ++x) {
      const diffusion::CameraRay& ray = problem.rays[x];
      const Tap u = tap(column + ray.column * depth / h[axis == 0 ? 1 : 0], block.face_width(face));
      const Tap v = tap(row + ray.row * depth / h[axis == 2 ? 1 : 2], block.face_height(face));
      const auto behind = static_cast<std::ptrdiff_t>(block.cell_behind(face, u.cell, v.cell));
      c.cells.push_back(
          static_cast<std::int32_t>(behind + layer * diffusion::inwards(block, face)));
      c.shares.push_back(u.share);
      c.shares.push_back(v.share);
    }
  }
}

std::array<std::size_t, 4> corners(const Block& block, Face face) {
  const std::size_t near = block.cell_behind(face, 0, 0);
  const int u = std::min(1, block.face_width(face) - 1);
  const int v = std::min(1, block.face_height(face) - 1);
  return {0,
          block.cell_behind(face, u, 0) - near,
          block.cell_behind(face, 0, v) - near,
          block.cell_behind(face, u, v) - near};
}

/// The samples' cells, turned into the cells' samples.
void transpose(const Block& block, Face face, Crossings& c) {
  const auto corner = corners(block, face);
  c.starts.assign(block.cell_count() + 1, 0);
  for (const std::int32_t cell : c.cells)
    for (const std::size_t offset : corner) ++c.starts[static_cast<std::size_t>(cell) + offset + 1];
  for (std::size_t i = 0; i < block.cell_count(); ++i) c.starts[i + 1] += c.starts[i];
  std::vector<std::int32_t> next(c.starts.begin(), c.starts.end() - 1);
  c.entries.resize(4 * c.cells.size());
  for (std::size_t s = 0; s < c.cells.size(); ++s)
    for (std::size_t j = 0; j < corner.size(); ++j) {
      const std::size_t cell = static_cast<std::size_t>(c.cells[s]) + corner[j];
      c.entries[static_cast<std::size_t>(next[cell]++)] = static_cast<std::int32_t>(4 * s + j);
    }
}

Crossings crossings(const ChannelProblem& problem) {
  const auto axis = static_cast<std::size_t>(axis_of(problem.seen_face));
  Crossings c;
  for (int layer = 0; layer < problem.block.cells()[axis]; ++layer) add_layer(problem, layer, c);
  for (const diffusion::CameraRay& ray : problem.rays)
    c.lengths.push_back(static_cast<float>(ray.stretch * problem.block.spacing()[axis]));
  transpose(problem.block, problem.seen_face, c);
  return c;
}

}  // namespace

Result<DeviceCameraRays> DeviceCameraRays::create(gpu::Context& context,
                                                  const ChannelProblem& problem) {
  const std::uint64_t cells = problem.block.cell_count();
  const std::uint64_t pixels = problem.rays.size();
  const Crossings c = crossings(problem);
  DeviceCameraRays rays;
  rays.pixel_groups_ = workgroups(pixels);
  rays.cell_groups_ = workgroups(cells);
  for (const auto bytes : {std::as_bytes(std::span(c.cells)),
                           std::as_bytes(std::span(c.shares)),
                           std::as_bytes(std::span(c.lengths)),
                           std::as_bytes(std::span(c.starts)),
                           std::as_bytes(std::span(c.entries))}) {
    auto sent = gpu::create_filled(context, bytes);
    if (!sent) return sent.error();
    rays.tables_.push_back(*std::move(sent));
  }
  const std::uint64_t sums = 4 * (cells + 2 * pixels);
  for (const std::uint64_t bytes : {16 * cells, 16 * cells, 16 * pixels, sums, 8 * cells}) {
    auto made = gpu::Buffer::create(context, bytes, gpu::Memory::kDevice);
    if (!made) return made.error();
    rays.tables_.push_back(*std::move(made));
  }
  return rays;
}

void DeviceCameraRays::trace(Recorder& recorder,
                             const ModelKernels& kernels,
                             const gpu::Buffer& coefficients,
                             const ModelPush& push) const {
  const DeviceCameraRays& at = *this;
  recorder.dispatch(kernels[ModelKernel::kCameraRays],
                    {&coefficients,
                     &at[kTapCells],
                     &at[kTapShares],
                     &at[kLengths],
                     &at[kLosses],
                     &at[kShares],
                     &at[kSurface]},
                    gpu::push_of(push),
                    {pixel_groups_, 1, 1});
}

void DeviceCameraRays::look(Recorder& recorder,
                            const ModelKernels& kernels,
                            const gpu::Buffer& irradiance,
                            const DeviceSolution& fluence,
                            const gpu::Buffer& seen,
                            const ModelPush& push) const {
  const DeviceCameraRays& at = *this;
  recorder.dispatch(kernels[ModelKernel::kLook],
                    {&at[kSurface],
                     &at[kShares],
                     &at[kTapCells],
                     &at[kTapShares],
                     &irradiance,
                     &fluence.high,
                     &fluence.low,
                     &seen},
                    gpu::push_of(push),
                    {pixel_groups_, static_cast<std::uint32_t>(push.face[1]), 1});
}

void DeviceCameraRays::source(Recorder& recorder,
                              const ModelKernels& kernels,
                              const gpu::Buffer& rims,
                              const gpu::Buffer& b,
                              const ModelPush& push) const {
  const DeviceCameraRays& at = *this;
  recorder.dispatch(
      kernels[ModelKernel::kRaySource],
      {&at[kStarts], &at[kEntries], &at[kTapShares], &at[kShares], &at[kSurface], &rims, &b},
      gpu::push_of(push),
      {cell_groups_, static_cast<std::uint32_t>(push.face[1]), 1});
}

void DeviceCameraRays::gather(Recorder& recorder,
                              const ModelKernels& kernels,
                              const gpu::Buffer& irradiance,
                              const gpu::Buffer& rims,
                              const DeviceSolution& fluence,
                              const ModelPush& push) const {
  const DeviceCameraRays& at = *this;
  recorder.dispatch(kernels[ModelKernel::kRaySums],
                    {&at[kSurface],
                     &at[kTapCells],
                     &at[kTapShares],
                     &irradiance,
                     &rims,
                     &fluence.high,
                     &fluence.low,
                     &at[kSums]},
                    gpu::push_of(push),
                    {pixel_groups_, 1, 1});
}

void DeviceCameraRays::add_gradient(Recorder& recorder,
                                    const ModelKernels& kernels,
                                    const gpu::Buffer& coefficients,
                                    const gpu::Buffer& gradient,
                                    const ModelPush& push) const {
  const DeviceCameraRays& at = *this;
  recorder.dispatch(
      kernels[ModelKernel::kRaySlopes],
      {&at[kLosses], &at[kShares], &at[kSurface], &at[kLengths], &at[kSums], &at[kSlopes]},
      gpu::push_of(push),
      {pixel_groups_, 1, 1});
  recorder.dispatch(kernels[ModelKernel::kRayGradient],
                    {&coefficients,
                     &at[kStarts],
                     &at[kEntries],
                     &at[kTapShares],
                     &at[kSlopes],
                     &at[kSums],
                     &gradient},
                    gpu::push_of(push),
                    {cell_groups_, 1, 1});
}

}  // namespace opaline::reconstruct::vulkan
