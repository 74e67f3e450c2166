#include "render/raster/raster_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "gpu/commands.h"
#include "render/raster/raster_buffers.h"
#include "render/raster/resolve_pass.h"
#include "render_raster_shaders.h"

namespace opaline::render {
namespace {

constexpr int kTile = 1024;          // samples along each side
constexpr double kNearShare = 1e-4;  // of the scene's radius, in front of the camera

struct RasterTone {
  std::array<float, 3> background;
  float gain;
  std::uint32_t count;
};

/// What one tile is drawn and averaged in.
struct RasterTile {
  gpu::RenderTarget target;
  gpu::Buffer samples;
  gpu::Buffer pixels;
  gpu::Buffer display;
  int width;  ///< pixels
  int height;
  int samples_per_axis;
};

Result<RasterTile> make_raster_tile(gpu::Context& context, int width, int height, int axis) {
  auto target = gpu::RenderTarget::create(context, width * axis, height * axis);
  if (!target) return target.error();
  auto samples = gpu::Buffer::create(context, target->color_bytes(), gpu::Memory::kDevice);
  if (!samples) return samples.error();
  const std::uint64_t count = std::uint64_t{1} * width * height;
  auto pixels = gpu::Buffer::create(context, 16 * count, gpu::Memory::kHost);
  if (!pixels) return pixels.error();
  auto display = gpu::Buffer::create(context, 4 * count, gpu::Memory::kHost);
  if (!display) return display.error();
  return RasterTile{*std::move(target),
                    *std::move(samples),
                    *std::move(pixels),
                    *std::move(display),
                    width,
                    height,
                    axis};
}

/// Sends values to a buffer, which is made where there is none of that size.
template <class T>
Result<void> send(gpu::Context& context,
                  std::span<const T> values,
                  std::optional<gpu::Buffer>& buffer) {
  if (!buffer || buffer->bytes() != values.size_bytes()) {
    buffer.reset();
    auto made = gpu::Buffer::create(context, values.size_bytes(), gpu::Memory::kDevice);
    if (!made) return made.error();
    buffer = *std::move(made);
  }
  return gpu::upload(context, std::as_bytes(values), *buffer);
}

/// Eye, environment and lights, as surface.frag reads them; never without a light, which std430 would leave nothing of.
std::vector<float> pack_scene(Vec3 eye,
                              const EnvironmentOptions& environment,
                              const std::vector<RasterLight>& lights) {
  std::vector<float> packed{static_cast<float>(eye.x),
                            static_cast<float>(eye.y),
                            static_cast<float>(eye.z),
                            static_cast<float>(lights.size())};
  for (const double c : environment.radiance) packed.push_back(static_cast<float>(c));
  packed.push_back(0.0F);
  const std::size_t head = packed.size();
  packed.resize(head + std::max<std::size_t>(1, lights.size()) * sizeof(RasterLight) / 4);
  if (!lights.empty()) {
    std::memcpy(packed.data() + head, lights.data(), lights.size() * sizeof(RasterLight));
  }
  return packed;
}

}  // namespace

struct RasterRenderer::State {
  RasterOptions options;
  std::unique_ptr<gpu::Context> context;  // first: destroyed last
  gpu::Pipeline surface;
  gpu::Pipeline shadow;
  gpu::Pipeline resolve;
  gpu::Pipeline display;
  gpu::Commands commands;
  std::optional<gpu::RenderTarget> shadow_target;
  std::vector<gpu::Buffer> maps;
  std::optional<gpu::Buffer> scene;
  std::optional<gpu::Buffer> objects;
  std::optional<gpu::Buffer> vertices;
  std::optional<gpu::Buffer> triangles;
  std::optional<RasterTile> tile;
  RasterLights lights;
  EnvironmentOptions environment;
  std::uint32_t corners = 0;
  double near_mm = 1e-3;

  Result<void> prepare_maps(std::size_t count);
  Result<void> draw_maps();
  Result<void> prepare_tile(int width, int height, int samples_per_axis);
  Result<void> prepare_view(const CameraModel& camera);
  void record_surfaces(const CameraModel& camera, int x0, int y0);
  Result<void> draw_tile(const CameraModel& camera, int x0, int y0);
};

Result<void> RasterRenderer::State::prepare_maps(std::size_t count) {
  const auto side = static_cast<std::uint32_t>(options.shadow_texels);
  if (!shadow_target && count > 0) {
    auto made = gpu::RenderTarget::create(*context, side, side);
    if (!made) return made.error();
    shadow_target = *std::move(made);
  }
  while (maps.size() < std::max<std::size_t>(1, count)) {
    const std::uint64_t bytes = count > 0 ? shadow_target->color_bytes() : 16;
    auto made = gpu::Buffer::create(*context, bytes, gpu::Memory::kDevice);
    if (!made) return made.error();
    maps.push_back(*std::move(made));
  }
  return ok();
}

Result<void> RasterRenderer::State::draw_maps() {
  if (!lights.maps.empty() && maps.size() == 1 && maps[0].bytes() == 16) maps.clear();
  if (auto made = prepare_maps(lights.maps.size()); !made) return made;
  for (std::size_t m = 0; m < lights.maps.size(); ++m) {
    if (auto begun = commands.begin(); !begun) return begun;
    commands.draw(shadow,
                  {{{&*vertices, &*triangles}}, gpu::push_of(lights.maps[m])},
                  corners,
                  *shadow_target);
    commands.copy_color(*shadow_target, maps[m]);
    commands.barrier();
    if (auto ended = commands.end(); !ended) return ended;
    if (auto done = context->run(commands); !done) return done;
  }
  return ok();
}

Result<void> RasterRenderer::State::prepare_tile(int width, int height, int samples_per_axis) {
  const int side = kTile / samples_per_axis;
  const int across = std::min(side, width);
  const int down = std::min(side, height);
  if (tile && tile->width == across && tile->height == down &&
      tile->samples_per_axis == samples_per_axis) {
    return ok();
  }
  tile.reset();
  auto made = make_raster_tile(*context, across, down, samples_per_axis);
  if (!made) return made.error();
  tile = *std::move(made);
  return ok();
}

Result<void> RasterRenderer::State::prepare_view(const CameraModel& camera) {
  if (!vertices) return invalid_argument("no scene has been taken");
  if (std::ranges::any_of(camera.distortion, [](double k) { return k != 0.0; })) {
    return invalid_argument("the rasteriser draws without a lens's distortion");
  }
  const auto packed = pack_scene(camera.centre(), environment, lights.lights);
  return send(*context, std::span<const float>(packed), scene);
}

void RasterRenderer::State::record_surfaces(const CameraModel& camera, int x0, int y0) {
  const Rows view = clip_from_scene(camera, x0, y0, tile->width, tile->height, near_mm);
  const auto map = [&](std::size_t m) { return &maps[std::min(m, maps.size() - 1)]; };
  const std::array<const gpu::Buffer*, 8> buffers{
      &*scene, &*objects, &*vertices, &*triangles, map(0), map(1), map(2), map(3)};
  commands.draw(surface, {buffers, gpu::push_of(view)}, corners, tile->target);
}

Result<void> RasterRenderer::State::draw_tile(const CameraModel& camera, int x0, int y0) {
  const ResolveShape shape{static_cast<std::uint32_t>(tile->width),
                           static_cast<std::uint32_t>(tile->height),
                           static_cast<std::uint32_t>(tile->samples_per_axis)};
  if (auto begun = commands.begin(); !begun) return begun;
  record_surfaces(camera, x0, y0);
  if (tile->samples_per_axis == 1) {
    commands.copy_color(tile->target, tile->pixels);
  } else {
    commands.copy_color(tile->target, tile->samples);
    commands.barrier();
    record_resolve(resolve, tile->samples, tile->pixels, shape, commands);
  }
  commands.barrier();
  if (auto ended = commands.end(); !ended) return ended;
  return context->run(commands);
}

RasterRenderer::RasterRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
RasterRenderer::~RasterRenderer() = default;

Result<std::unique_ptr<RasterRenderer>> RasterRenderer::create(const RasterOptions& options) {
  if (options.shadow_texels < 16 || options.shadow_texels > 2048) {
    return invalid_argument(
        fmt::format("shadow_texels = {}; expected 16 to 2048", options.shadow_texels));
  }
  gpu::ContextOptions wanted = options.gpu;
  wanted.device.graphics = true;
  auto context = gpu::Context::create(wanted);
  if (!context) return context.error().in("raster renderer");
  auto surface = gpu::Pipeline::create_raster(
      **context, "surface", shaders::surface_vert, shaders::surface_frag, {8, sizeof(Rows)});
  if (!surface) return surface.error();
  auto shadow = gpu::Pipeline::create_raster(
      **context, "shadow", shaders::shadow_vert, shaders::shadow_frag, {2, sizeof(Rows)});
  if (!shadow) return shadow.error();
  auto resolve = make_resolve_pass(**context);
  if (!resolve) return resolve.error();
  auto display = gpu::Pipeline::create_compute(
      **context, "display", shaders::display_comp, {2, sizeof(RasterTone)});
  if (!display) return display.error();
  auto commands = gpu::Commands::create(**context);
  if (!commands) return commands.error();
  return std::unique_ptr<RasterRenderer>(
      new RasterRenderer(std::unique_ptr<State>(new State{.options = options,
                                                          .context = *std::move(context),
                                                          .surface = *std::move(surface),
                                                          .shadow = *std::move(shadow),
                                                          .resolve = *std::move(resolve),
                                                          .display = *std::move(display),
                                                          .commands = *std::move(commands),
                                                          .shadow_target = {},
                                                          .maps = {},
                                                          .scene = {},
                                                          .objects = {},
                                                          .vertices = {},
                                                          .triangles = {},
                                                          .tile = {},
                                                          .lights = {},
                                                          .environment = {}})));
}

Result<void> RasterRenderer::take(const SceneRenderer& scene) {
  State& s = *state_;
  const RasterGeometry geometry = raster_geometry(scene.drawn());
  s.lights = raster_lights(scene.lights(), geometry, s.options.shadow_texels);
  s.environment = scene.environment();
  s.near_mm = kNearShare * geometry.all.radius;
  s.corners = static_cast<std::uint32_t>(3 * geometry.triangles.size());
  using Triangle = std::array<std::int32_t, 4>;
  auto sent = send(*s.context, std::span<const RasterVertex>(geometry.vertices), s.vertices);
  if (sent) sent = send(*s.context, std::span<const Triangle>(geometry.triangles), s.triangles);
  if (sent) sent = send(*s.context, std::span<const RasterObject>(geometry.objects), s.objects);
  if (!sent) return sent.error().in("the scene's surfaces");
  if (auto drawn = s.draw_maps(); !drawn) return drawn.error().in("shadow maps");
  return ok();
}

Result<Image<float>> RasterRenderer::draw(const CameraModel& camera,
                                          int samples_per_axis,
                                          std::stop_token stop) {
  State& s = *state_;
  if (samples_per_axis < 1 || samples_per_axis > 16) {
    return invalid_argument(fmt::format("{} samples; expected 1 to 16", samples_per_axis));
  }
  if (auto ready = s.prepare_view(camera); !ready) return ready.error();
  if (auto made = s.prepare_tile(camera.width, camera.height, samples_per_axis); !made) {
    return made.error();
  }
  Image<float> picture(camera.width, camera.height, 4);
  for (int y = 0; y < camera.height; y += s.tile->height) {
    for (int x = 0; x < camera.width; x += s.tile->width) {
      if (stop.stop_requested()) return cancelled("drawing the picture");
      if (auto drawn = s.draw_tile(camera, x, y); !drawn) return drawn.error().in("drawing");
      const int width = std::min(s.tile->width, camera.width - x);
      const int height = std::min(s.tile->height, camera.height - y);
      const float* const pixels = s.tile->pixels.floats().data();
      for (int j = 0; j < height; ++j) {
        std::copy_n(
            pixels + std::ptrdiff_t{4} * j * s.tile->width, 4 * width, &picture.at(x, y + j));
      }
    }
  }
  return picture;
}

Result<Image<std::uint8_t>> RasterRenderer::display(const CameraModel& camera, const Tone& tone) {
  State& s = *state_;
  if (auto ready = s.prepare_view(camera); !ready) return ready.error();
  if (auto made = s.prepare_tile(camera.width, camera.height, 1); !made) return made.error();
  Image<std::uint8_t> picture(camera.width, camera.height, 4);
  const RasterTone push{{static_cast<float>(tone.background[0]),
                         static_cast<float>(tone.background[1]),
                         static_cast<float>(tone.background[2])},
                        static_cast<float>(tone.gain),
                        static_cast<std::uint32_t>(s.tile->width * s.tile->height)};
  for (int y = 0; y < camera.height; y += s.tile->height) {
    for (int x = 0; x < camera.width; x += s.tile->width) {
      if (auto begun = s.commands.begin(); !begun) return begun.error();
      s.record_surfaces(camera, x, y);
      s.commands.copy_color(s.tile->target, s.tile->samples);
      s.commands.barrier();
      s.commands.dispatch(s.display,
                          {{{&s.tile->samples, &s.tile->display}}, gpu::push_of(push)},
                          {(push.count + 127) / 128, 1, 1});
      s.commands.barrier();
      if (auto ended = s.commands.end(); !ended) return ended.error();
      if (auto done = s.context->run(s.commands); !done) return done.error().in("drawing");
      const int width = std::min(s.tile->width, camera.width - x);
      const int height = std::min(s.tile->height, camera.height - y);
      const auto bytes = s.tile->display.mapped();
      for (int j = 0; j < height; ++j) {
        std::memcpy(&picture.at(x, y + j),
                    bytes.data() + std::ptrdiff_t{4} * j * s.tile->width,
                    std::size_t{4} * width);
      }
    }
  }
  return picture;
}

const std::vector<std::string>& RasterRenderer::left_out() const { return state_->lights.left_out; }

std::string RasterRenderer::description() const { return state_->context->device().name; }

}  // namespace opaline::render
