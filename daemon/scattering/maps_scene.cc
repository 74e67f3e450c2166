#include "daemon/scattering/maps_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <thread>
#include <utility>

#include "daemon/scattering/dipole_view.h"
#include "reconstruct/spherical_gradient/exit_law.h"

namespace opaline::daemon {
namespace {

using render::LinearLight;

/// Constant light, and constant light with a whole gradient along x, y, z.
constexpr std::array<LinearLight, 4> kBasis{LinearLight{1.0, {}},
                                            LinearLight{1.0, {1.0, 0.0, 0.0}},
                                            LinearLight{1.0, {0.0, 1.0, 0.0}},
                                            LinearLight{1.0, {0.0, 0.0, 1.0}}};

std::array<double, 4> terms_of(const LinearLight& light) {
  return {light.constant, light.gradient.x, light.gradient.y, light.gradient.z};
}

Image<float> summed(const std::array<Image<float>, 4>& basis, const LinearLight& light) {
  Image<float> sum(basis[0].width(), basis[0].height(), 3);
  const auto terms = terms_of(light);
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t n = 0; n < sum.samples().size(); ++n)
      sum.samples()[n] += static_cast<float>(terms[k]) * basis[k].samples()[n];
  return sum;
}

/// What the four pictures of one channel say under constant light, and what each gradient adds to it.
std::array<float, 4> terms_at(const reconstruct::StagePictures& p, std::size_t at) {
  std::array<float, 4> terms{p.constant.radiance[at]};
  for (std::size_t a = 0; a < 3; ++a)
    terms[a + 1] = p.minuses.empty() ? 2.0F * p.gradients[a].radiance[at] - terms[0]
                                     : p.gradients[a].radiance[at] - p.minuses[a].radiance[at];
  return terms;
}

std::array<Image<float>, 4> captured_terms(const SphereSession& session, const Relief& r) {
  std::array<Image<float>, 4> terms;
  for (Image<float>& term : terms) term = Image<float>(r.width, r.height, 3);
  const double white = white_radiance(session.record);
  for (int c = 0; c < 3; ++c) {
    const auto pictures = channel_pictures(session, c);
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) {
        if (!r.has(x, y)) continue;
        const auto at =
            static_cast<std::size_t>(y * r.step) * static_cast<std::size_t>(pictures.width) +
            static_cast<std::size_t>(x * r.step);
        const auto here = terms_at(pictures, at);
        for (std::size_t k = 0; k < 4; ++k)
          terms[k].at(x, y, c) = static_cast<float>(here[k] / white);
      }
  }
  return terms;
}

}  // namespace

bool is_session_directory(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_directory(path, none);
}

Result<LinearLight> light_of_pattern(const std::string& name) {
  if (name == "constant") return LinearLight{1.0, {}};
  for (std::size_t a = 0; a < 3; ++a)
    if (name == fmt::format("gradient_{}", "xyz"[a])) {
      const Vec3 whole = kBasis[a + 1].gradient;
      return LinearLight{0.5, whole * 0.5};
    }
  return invalid_argument(
      fmt::format("light \"{}\"; expected constant, gradient_x, gradient_y or gradient_z", name));
}

MapsScene::MapsScene(SphereSession session, SphereMaps maps, double ior, std::string name)
    : session_(std::move(session)),
      maps_(std::move(maps)),
      relief_(relief_of(maps_, session_)),
      ior_(ior),
      name_(std::move(name)),
      captured_(captured_terms(session_, relief_)) {}

Result<MapsScene> MapsScene::open(const std::filesystem::path& path,
                                  const TurnedViewOptions& options) {
  const auto directory = SessionDirectory::open(path);
  if (!directory) return directory.error();
  const auto config = config::load_resolved(*directory);
  if (!config) return config.error();
  if (config->kind != config::SessionKind::kLedSphere)
    return invalid_argument(fmt::format(
        "{}: not of a sphere of lights, so without maps; give a scene.toml", path.string()));
  auto session = read_sphere_session(*directory, config->led_sphere);
  if (!session) return session.error();
  auto maps = read_maps(*directory);
  if (!maps) return maps.error();
  if (maps->channels[0].left_out.size() != session->measured.pixel_count())
    return invalid_argument("maps.exr and hdr/ are of other sizes: run opaline-reconstruct again");
  return make(
      *std::move(session), *std::move(maps), config->led_sphere.ior, config->sample_name, options);
}

Result<MapsScene> MapsScene::make(SphereSession session,
                                  SphereMaps maps,
                                  double ior,
                                  std::string name,
                                  const TurnedViewOptions& options) {
  MapsScene scene(std::move(session), std::move(maps), ior, std::move(name));
  for (const auto& channel : scene.maps_.channels)
    if (auto known = nearest_maps(scene.relief_, channel); !known) return known.error();
  auto mesh = mesh_of(scene.relief_, options);
  if (!mesh) return mesh.error();
  scene.mesh_ = *std::move(mesh);
  scene.has_mesh_ = !options.mesh.empty();
  return scene;
}

Image<float> MapsScene::captured(const LinearLight& light) const {
  return summed(captured_, light);
}

Result<void> MapsScene::sum_dipoles(const std::stop_token& stop) {
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  const reconstruct::ExitLaw law(ior_);
  std::array<Image<float>, 4> sums;
  for (Image<float>& sum : sums) sum = Image<float>(relief_.width, relief_.height, 3);
  render::TexelSurface surface = seen_surface(maps_, relief_);
  for (std::size_t c = 0; c < 3; ++c) {
    auto known = nearest_maps(relief_, maps_.channels[c]);
    if (!known) return known.error();
    surface.reduced_albedo = std::move(known->reduced_albedo);
    surface.diffusion = std::move(known->diffusion);
    for (std::size_t k = 0; k < 4; ++k) {
      if (stop.stop_requested()) return cancelled("dipole rendering: stopped");
      const auto exitance = render::diffuse_texels(surface, kBasis[k], ior_, team);
      if (!exitance) return exitance.error();
      for (std::size_t at = 0; at < exitance->size(); ++at) {
        if (surface.covered[at] == 0) continue;
        const double leaving = law.at(surface.normal[at].z) / std::numbers::pi;
        const auto radiance = static_cast<float>((*exitance)[at] * leaving);
        sums[k].samples()[3 * at + c] =
            k == 0 ? radiance : radiance - sums[0].samples()[3 * at + c];
      }
    }
  }
  rendered_ = std::move(sums);
  return ok();
}

Result<Image<float>> MapsScene::rendered(const LinearLight& light, std::stop_token stop) {
  if (rendered_[0].pixel_count() == 0)
    if (auto done = sum_dipoles(stop); !done) return done.error();
  return summed(rendered_, light);
}

Result<Image<float>> MapsScene::turned(double right_deg,
                                       double up_deg,
                                       const LinearLight& light,
                                       int most_pixels,
                                       std::stop_token stop) const {
  TurnedViewOptions options;
  options.turn_deg = right_deg;
  options.tilt_deg = up_deg;
  options.most_pixels = most_pixels;
  const render::ParallelView view = view_of(mesh_, options);
  Image<float> picture(view.width, view.height, 3);
  const std::array lights{
      LinearLight{light.constant, {light.gradient.x, -light.gradient.y, light.gradient.z}}};
  const std::array<Image<float>*, 1> pictures{&picture};
  auto drawn =
      draw_in_screen_space(maps_, relief_, ior_, mesh_, view, lights, pictures, std::move(stop));
  if (!drawn) return drawn.error();
  return picture;
}

}  // namespace opaline::daemon
