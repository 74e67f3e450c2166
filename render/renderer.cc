#include "render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "base/log.h"
#include "gpu/commands.h"
#include "render/block_rays.h"
#include "render/raster/picture_tile.h"
#include "render/scene_buffer.h"
#include "render_shaders.h"

namespace opaline::render {
namespace {

struct TilePush {
  std::array<std::int32_t, 2> origin;
  std::array<std::int32_t, 2> size;
};

template <class T>
Result<gpu::Buffer> buffer_of(gpu::Context& context, std::span<const T> values) {
  auto buffer = gpu::Buffer::create(context, values.size_bytes(), gpu::Memory::kDevice);
  if (!buffer) return buffer;
  if (auto sent = gpu::upload(context, std::as_bytes(values), *buffer); !sent) return sent.error();
  return buffer;
}

}  // namespace

struct Renderer::State {
  RendererOptions options;
  std::unique_ptr<gpu::Context> context;  // first: destroyed last
  gpu::Pipeline draw;
  gpu::Pipeline resolve;
  gpu::Commands commands;
  std::optional<PictureTile> tile;

  Result<void> draw_tile(
      const gpu::Buffer& scene, const gpu::Buffer& field, int faces, int x0, int y0);
};

Result<void> Renderer::State::draw_tile(
    const gpu::Buffer& scene, const gpu::Buffer& field, int faces, int x0, int y0) {
  const int s = options.samples_per_axis;
  const TilePush where{{x0 * s, y0 * s}, {tile->width * s, tile->height * s}};
  const std::uint32_t vertices = 6U * kSegments * kSegments * faces;
  if (auto begun = commands.begin(); !begun) return begun;
  commands.draw(draw, {{{&scene, &field}}, gpu::push_of(where)}, vertices, tile->target);
  tile->record_average(resolve, commands);
  if (auto ended = commands.end(); !ended) return ended;
  return context->run(commands);
}

Renderer::Renderer(const RendererOptions& options, std::unique_ptr<State> state)
    : options_(options), state_(std::move(state)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
  if (options.samples_per_axis < 1 || options.samples_per_axis > 8)
    return invalid_argument(
        fmt::format("samples_per_axis = {}; expected 1 to 8", options.samples_per_axis));
  if (options.host_threads > 0) {
    return std::unique_ptr<Renderer>(new Renderer(options, nullptr));
  }
  gpu::ContextOptions wanted = options.gpu;
  wanted.device.graphics = true;
  auto context = gpu::Context::create(wanted);
  if (!context) return context.error().in("renderer");
  auto draw = gpu::Pipeline::create_raster(
      **context, "block", shaders::block_vert, shaders::block_frag, {2, sizeof(TilePush)});
  if (!draw) return draw.error();
  auto resolve = make_resolve_pass(**context);
  if (!resolve) return resolve.error();
  auto commands = gpu::Commands::create(**context);
  if (!commands) return commands.error();
  return std::unique_ptr<Renderer>(
      new Renderer(options,
                   std::unique_ptr<State>(new State{options,
                                                    *std::move(context),
                                                    *std::move(draw),
                                                    *std::move(resolve),
                                                    *std::move(commands),
                                                    {}})));
}

Result<std::unique_ptr<Renderer>> Renderer::create_or_host(RendererOptions options,
                                                           int host_threads) {
  auto made = create(options);
  if (made || made.error().code != ErrorCode::kUnavailable) return made;
  log::warning("{}: drawing without a device", made.error().message);
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  options.host_threads = std::max(1, host_threads > 0 ? host_threads : cores);
  return create(options);
}

Result<Image<float>> Renderer::draw(const SurfaceField& field,
                                    const CameraModel& camera,
                                    std::stop_token stop) {
  if (!state_) {
    return draw_by_rays(
        field, camera, options_.samples_per_axis, options_.host_threads, std::move(stop));
  }
  if (auto good = validate(field); !good) return good.error();
  const auto scene = describe_scene(field, camera, state_->options.samples_per_axis);
  if (!scene) return scene.error();
  const auto gpu_scene = buffer_of(*state_->context, std::span(&*scene, 1));
  if (!gpu_scene) return gpu_scene.error();
  const std::vector<float> packed = pack_field(field);
  const auto gpu_field = buffer_of(*state_->context, std::span<const float>(packed));
  if (!gpu_field) return gpu_field.error().in("the light field on the sample's surface");
  auto made = prepare_tile(*state_->context,
                           camera.width,
                           camera.height,
                           state_->options.samples_per_axis,
                           state_->tile);
  if (!made) return made.error();
  Image<float> picture(camera.width, camera.height, 4);
  for (int y = 0; y < camera.height; y += state_->tile->height)
    for (int x = 0; x < camera.width; x += state_->tile->width) {
      if (stop.stop_requested()) return cancelled("drawing was stopped");
      auto drawn = state_->draw_tile(*gpu_scene, *gpu_field, scene->visible[3], x, y);
      if (!drawn) return drawn.error().in("drawing");
      state_->tile->copy_to(x, y, picture);
    }
  return picture;
}

std::string Renderer::description() const {
  const int s = options_.samples_per_axis;
  if (!state_) return fmt::format("host rays, {} samples a pixel", s * s);
  return fmt::format("{}, {} samples a pixel", state_->context->device().name, s * s);
}

}  // namespace opaline::render
