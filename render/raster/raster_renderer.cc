#include "render/raster/raster_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "gpu/commands.h"
#include "render/raster/picture_tile.h"
#include "render/raster/raster_buffers.h"
#include "render/raster/sent_buffer.h"
#include "render/raster/shadow_maps.h"
#include "render_raster_shaders.h"

namespace opaline::render {
namespace {

constexpr double kNearShare = 1e-4;  // of the scene's radius, in front of the camera

struct RasterTone {
  std::array<float, 3> background;
  float gain;
  std::uint32_t count;
};

/// As surface.frag has it, std140.
struct RasterScene {
  Vec4f eye;
  Vec4f environment;
  std::array<RasterLight, kMostLights> lights;
};
static_assert(sizeof(RasterScene) <= 16384);

RasterScene pack_scene(Vec3 eye,
                       const EnvironmentOptions& environment,
                       const std::vector<RasterLight>& lights) {
  RasterScene packed{};
  packed.eye = {static_cast<float>(eye.x),
                static_cast<float>(eye.y),
                static_cast<float>(eye.z),
                static_cast<float>(lights.size())};
  for (int c = 0; c < 3; ++c) packed.environment[c] = static_cast<float>(environment.radiance[c]);
  std::ranges::copy(lights, packed.lights.begin());
  return packed;
}

struct SurfacePasses {
  gpu::Pipeline closed;  // only fronts
  gpu::Pipeline open;
};

Result<SurfacePasses> make_surface_passes(gpu::Context& context) {
  const gpu::Interface interface { 5, sizeof(Rows), 1 };
  auto closed = gpu::Pipeline::create_raster(context,
                                             "closed surfaces",
                                             shaders::surface_vert,
                                             shaders::surface_frag,
                                             interface,
                                             gpu::Sides::kFront);
  if (!closed) return closed.error();
  auto open = gpu::Pipeline::create_raster(
      context, "surfaces", shaders::surface_vert, shaders::surface_frag, interface);
  if (!open) return open.error();
  return SurfacePasses{*std::move(closed), *std::move(open)};
}

}  // namespace

struct RasterRenderer::State {
  RasterOptions options;
  std::unique_ptr<gpu::Context> context;  // first: destroyed last
  SurfacePasses surfaces;
  gpu::Pipeline resolve;
  gpu::Pipeline display;
  gpu::Commands commands;
  ShadowMaps shadows;
  SentBuffer scene;
  SentBuffer objects;
  SentBuffer vertices;
  SentBuffer corners;
  SentBuffer glow;
  std::optional<PictureTile> tile;
  std::optional<gpu::Buffer> shown;  // a tile in 8 bits
  RasterGeometry geometry;
  std::uint64_t shape = 0;  // that the geometry is of
  RasterLights lights;
  EnvironmentOptions environment;

  Result<void> record_shape(const SceneRenderer& from);
  Result<void> record_taking(const SceneRenderer& from);
  Result<void> begin_view(const CameraModel& camera);
  void record_surfaces(const CameraModel& camera, int x0, int y0);
  Result<void> finish();
  gpu::Commands::Indexed triangles(std::uint32_t first, std::uint32_t last) const {
    return {corners.buffer(), first, last - first};
  }
};

Result<void> RasterRenderer::State::finish() {
  if (auto ended = commands.end(); !ended) return ended;
  return context->run(commands);
}

Result<void> RasterRenderer::State::record_shape(const SceneRenderer& from) {
  geometry = raster_geometry(from.drawn());
  auto sent = vertices.send(*context, geometry.vertices, commands);
  if (sent) sent = corners.send(*context, geometry.corners, commands);
  return sent;
}

Result<void> RasterRenderer::State::record_taking(const SceneRenderer& from) {
  const bool other_shape = shape != from.shape();
  if (other_shape) {
    if (auto sent = record_shape(from); !sent) return sent;
  }
  auto sent = glow.send(*context, raster_glow(from.drawn(), geometry), commands);
  if (sent) sent = objects.send(*context, raster_objects(from.drawn()), commands);
  if (!sent) return sent;
  commands.barrier();
  lights = raster_lights(from.lights(), geometry, options.shadow_texels);
  environment = from.environment();
  shape = from.shape();
  if (!other_shape && !shadows.differ(lights.maps)) return ok();
  const auto all = static_cast<std::uint32_t>(geometry.corners.size());
  auto drawn =
      shadows.record(*context, lights.maps, vertices.buffer(), triangles(0, all), commands);
  commands.barrier();
  return drawn;
}

/// Begins the commands of a tile.
Result<void> RasterRenderer::State::begin_view(const CameraModel& camera) {
  if (!glow.is_there()) return invalid_argument("no scene has been taken");
  if (std::ranges::any_of(camera.distortion, [](double k) { return k != 0.0; })) {
    return invalid_argument("the rasteriser draws without a lens's distortion");
  }
  if (auto begun = commands.begin(); !begun) return begun;
  const RasterScene packed = pack_scene(camera.centre(), environment, lights.lights);
  auto sent = scene.send(*context, std::as_bytes(std::span(&packed, 1)), commands);
  commands.barrier();
  return sent;
}

void RasterRenderer::State::record_surfaces(const CameraModel& camera, int x0, int y0) {
  const double near_mm = kNearShare * geometry.all.radius;
  const Rows view = clip_from_scene(camera, x0, y0, tile->width, tile->height, near_mm);
  const std::array<const gpu::Buffer*, 5> buffers{
      &scene.buffer(), &objects.buffer(), &vertices.buffer(), &glow.buffer(), &shadows.maps()};
  const gpu::Arguments arguments{buffers, gpu::push_of(view)};
  const std::uint32_t closed = geometry.closed_corners;
  const auto all = static_cast<std::uint32_t>(geometry.corners.size());
  commands.draw(surfaces.closed, arguments, triangles(0, closed), tile->target, /*clear=*/true);
  if (all > closed) {
    commands.draw(surfaces.open, arguments, triangles(closed, all), tile->target, /*clear=*/false);
  }
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
  auto surfaces = make_surface_passes(**context);
  if (!surfaces) return surfaces.error();
  auto shadows = ShadowMaps::create(**context, options.shadow_texels);
  if (!shadows) return shadows.error();
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
                                                          .surfaces = *std::move(surfaces),
                                                          .resolve = *std::move(resolve),
                                                          .display = *std::move(display),
                                                          .commands = *std::move(commands),
                                                          .shadows = *std::move(shadows),
                                                          .scene = {},
                                                          .objects = {},
                                                          .vertices = {},
                                                          .corners = {},
                                                          .glow = {},
                                                          .tile = {},
                                                          .shown = {},
                                                          .geometry = {},
                                                          .lights = {},
                                                          .environment = {}})));
}

Result<void> RasterRenderer::take(const SceneRenderer& scene) {
  State& s = *state_;
  if (auto begun = s.commands.begin(); !begun) return begun;
  if (auto recorded = s.record_taking(scene); !recorded) {
    s.shape = 0;
    return recorded.error().in("the scene's surfaces");
  }
  auto done = s.finish();
  if (!done) return done.error().in("the scene's surfaces");
  return done;
}

Result<Image<float>> RasterRenderer::draw(const CameraModel& camera,
                                          int samples_per_axis,
                                          std::stop_token stop) {
  State& s = *state_;
  if (samples_per_axis < 1 || samples_per_axis > 16) {
    return invalid_argument(fmt::format("{} samples; expected 1 to 16", samples_per_axis));
  }
  auto made = prepare_tile(*s.context, camera.width, camera.height, samples_per_axis, s.tile);
  if (!made) return made.error();
  Image<float> picture(camera.width, camera.height, 4);
  for (int y = 0; y < camera.height; y += s.tile->height) {
    for (int x = 0; x < camera.width; x += s.tile->width) {
      if (stop.stop_requested()) return cancelled("drawing the picture");
      if (auto begun = s.begin_view(camera); !begun) return begun.error();
      s.record_surfaces(camera, x, y);
      s.tile->record_average(s.resolve, s.commands);
      if (auto done = s.finish(); !done) return done.error().in("drawing");
      s.tile->copy_to(x, y, picture);
    }
  }
  return picture;
}

Result<Image<std::uint8_t>> RasterRenderer::display(const CameraModel& camera, const Tone& tone) {
  State& s = *state_;
  auto made = prepare_tile(*s.context, camera.width, camera.height, 1, s.tile);
  if (!made) return made.error();
  const auto pixels = std::uint64_t{1} * s.tile->width * s.tile->height;
  if (!s.shown || s.shown->bytes() != 4 * pixels) {
    s.shown.reset();
    auto shown = gpu::Buffer::create(*s.context, 4 * pixels, gpu::Memory::kHost);
    if (!shown) return shown.error();
    s.shown = *std::move(shown);
  }
  Image<std::uint8_t> picture(camera.width, camera.height, 4);
  const RasterTone push{{static_cast<float>(tone.background[0]),
                         static_cast<float>(tone.background[1]),
                         static_cast<float>(tone.background[2])},
                        static_cast<float>(tone.gain),
                        static_cast<std::uint32_t>(pixels)};
  for (int y = 0; y < camera.height; y += s.tile->height) {
    for (int x = 0; x < camera.width; x += s.tile->width) {
      if (auto begun = s.begin_view(camera); !begun) return begun.error();
      s.record_surfaces(camera, x, y);
      s.commands.copy_color(s.tile->target, s.tile->samples);
      s.commands.barrier();
      s.commands.dispatch(s.display,
                          {{{&s.tile->samples, &*s.shown}}, gpu::push_of(push)},
                          {(push.count + 127) / 128, 1, 1});
      s.commands.barrier();
      if (auto done = s.finish(); !done) return done.error().in("drawing");
      const int width = std::min(s.tile->width, camera.width - x);
      const int height = std::min(s.tile->height, camera.height - y);
      const auto bytes = s.shown->mapped();
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
