#include "render/raster/picture_tile.h"

#include <algorithm>

#include "render_resolve_shaders.h"

namespace opaline::render {
namespace {

constexpr int kTileSamples = 1024;  // along each side

struct ResolveShape {
  std::uint32_t width;  // pixels
  std::uint32_t height;
  std::uint32_t samples_per_axis;
};

Result<PictureTile> make_tile(gpu::Context& context, int width, int height, int axis) {
  auto target = gpu::RenderTarget::create(context, width * axis, height * axis);
  if (!target) return target.error();
  auto samples = gpu::Buffer::create(context, target->color_bytes(), gpu::Memory::kDevice);
  if (!samples) return samples.error();
  const std::uint64_t count = std::uint64_t{1} * width * height;
  auto pixels = gpu::Buffer::create(context, 16 * count, gpu::Memory::kHost);
  if (!pixels) return pixels.error();
  return PictureTile{
      *std::move(target), *std::move(samples), *std::move(pixels), width, height, axis};
}

}  // namespace

void PictureTile::record_average(const gpu::Pipeline& resolve, gpu::Commands& commands) {
  if (samples_per_axis == 1) {
    commands.copy_color(target, pixels);
    commands.barrier();
    return;
  }
  commands.copy_color(target, samples);
  commands.barrier();
  const ResolveShape shape{static_cast<std::uint32_t>(width),
                           static_cast<std::uint32_t>(height),
                           static_cast<std::uint32_t>(samples_per_axis)};
  commands.dispatch(resolve,
                    {{{&samples, &pixels}}, gpu::push_of(shape)},
                    {(shape.width * shape.height + 127) / 128, 1, 1});
  commands.barrier();
}

void PictureTile::copy_to(int x0, int y0, Image<float>& picture) {
  const int across = std::min(width, picture.width() - x0);
  const int down = std::min(height, picture.height() - y0);
  const std::span<float> from = pixels.floats();
  for (int y = 0; y < down; ++y) {
    std::copy_n(from.begin() + std::ptrdiff_t{4} * y * width, 4 * across, &picture.at(x0, y0 + y));
  }
}

Result<void> prepare_tile(gpu::Context& context,
                          int width,
                          int height,
                          int samples_per_axis,
                          std::optional<PictureTile>& tile) {
  const int side = kTileSamples / samples_per_axis;
  const int across = std::min(side, width);
  const int down = std::min(side, height);
  if (tile && tile->width == across && tile->height == down &&
      tile->samples_per_axis == samples_per_axis) {
    return ok();
  }
  tile.reset();
  auto made = make_tile(context, across, down, samples_per_axis);
  if (!made) return made.error();
  tile = *std::move(made);
  return ok();
}

Result<gpu::Pipeline> make_resolve_pass(gpu::Context& context) {
  return gpu::Pipeline::create_compute(
      context, "resolve", shaders::resolve_comp, {2, sizeof(ResolveShape)});
}

}  // namespace opaline::render
