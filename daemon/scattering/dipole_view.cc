#include "daemon/scattering/dipole_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "daemon/scattering/turned_view.h"
#include "reconstruct/spherical_gradient/exit_law.h"
#include "render/dipole/texture_diffusion.h"

namespace opaline::daemon {
namespace {

constexpr double kSteepestTexel = 0.2;  // n_z below which a texel's area is not believed

/// The light of a pattern over that of the constant one; the picture it is compared with.
struct Pattern {
  const char* name = "";
  render::LinearLight light;
};
constexpr std::array<Pattern, 4> kPatterns{Pattern{"constant", {1.0, {}}},
                                           Pattern{"gradient_x", {0.5, {0.5, 0.0, 0.0}}},
                                           Pattern{"gradient_y", {0.5, {0.0, 0.5, 0.0}}},
                                           Pattern{"gradient_z", {0.5, {0.0, 0.0, 0.5}}}};

void compare(DipoleView& view) {
  double off = 0.0;
  double square = 0.0;
  double rendered = 0.0;
  double captured = 0.0;
  for (std::size_t n = 0; n < view.captured.samples().size(); ++n) {
    const double r = view.rendered.samples()[n];
    const double c = view.captured.samples()[n];
    off += (r - c) * (r - c);
    square += c * c;
    rendered += r;
    captured += c;
  }
  if (!(square > 0.0)) return;
  view.error = std::sqrt(off / square);
  view.scale = rendered / captured;
}

void put(const Image<float>& from, int left, Image<float>& all) {
  const int top = (all.height() - from.height()) / 2;
  for (int y = 0; y < from.height(); ++y)
    for (int x = 0; x < from.width(); ++x)
      for (int k = 0; k < 3; ++k) all.at(left + x, top + y, k) = from.at(x, y, k);
}

}  // namespace

render::TexelSurface seen_surface(const SphereMaps& maps, const Relief& r) {
  const std::size_t count = r.height_mm.size();
  render::TexelSurface s{.width = r.width, .height = r.height, .texel_mm = r.cell_mm};
  s.position.resize(count);
  s.normal.resize(count);
  s.area.assign(count, 0.0F);
  s.covered.assign(count, 0);
  const Image<float> normals = mean_normals(maps);
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x) {
      if (!r.has(x, y)) continue;
      const auto at = static_cast<std::size_t>(y * r.width + x);
      const auto n = [&](int k) -> double { return normals.at(x * r.step, y * r.step, k); };
      s.position[at] = {(x + 0.5) * r.cell_mm, (y + 0.5) * r.cell_mm, r.at(x, y)};
      s.normal[at] = {n(0), n(1), n(2)};
      s.area[at] = static_cast<float>(r.cell_mm * r.cell_mm / std::max(kSteepestTexel, n(2)));
      s.covered[at] = 1;
    }
  return s;
}

Result<std::vector<DipoleView>> dipole_views(const SphereMaps& maps,
                                             const SphereSession& session,
                                             double ior,
                                             std::stop_token stop) {
  const Relief relief = relief_of(maps, session);
  render::TexelSurface surface = seen_surface(maps, relief);
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  std::vector<DipoleView> views;
  for (const Pattern& pattern : kPatterns)
    if (session.pictures.contains(pattern.name))
      views.push_back({pattern.name,
                       Image<float>(relief.width, relief.height, 3),
                       Image<float>(relief.width, relief.height, 3)});
  const double white = white_radiance(session.record);
  const reconstruct::ExitLaw law(ior);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto known = nearest_maps(relief, maps.channels[c]);
    if (!known) return known.error();
    surface.reduced_albedo = known->reduced_albedo;
    surface.diffusion = known->diffusion;
    std::size_t v = 0;
    for (const Pattern& pattern : kPatterns) {
      if (!session.pictures.contains(pattern.name)) continue;
      if (stop.stop_requested()) return cancelled("dipole rendering: stopped");
      DipoleView& view = views[v++];
      const auto exitance = render::diffuse_texels(surface, pattern.light, ior, team);
      if (!exitance) return exitance.error();
      const Image<float>& seen = session.pictures.at(pattern.name).radiance;
      const double picture_scale = session.record.find(pattern.name)->scale * white;
      for (int y = 0; y < relief.height; ++y)
        for (int x = 0; x < relief.width; ++x) {
          const auto at = static_cast<std::size_t>(y * relief.width + x);
          if (surface.covered[at] == 0) continue;
          const int k = static_cast<int>(c);
          const double leaving = law.at(surface.normal[at].z);
          view.rendered.at(x, y, k) =
              static_cast<float>((*exitance)[at] / std::numbers::pi * leaving);
          view.captured.at(x, y, k) =
              static_cast<float>(seen.at(x * relief.step, y * relief.step, k) / picture_scale);
        }
    }
  }
  if (!views.empty()) {
    auto screen = captured_view_in_screen_space(maps, relief, ior, stop);
    if (!screen) return screen.error();
    DipoleView view{"screen_space", views.front().captured, *std::move(screen)};
    for (std::size_t n = 0; n < view.captured.samples().size(); ++n)
      if (view.rendered.samples()[n] == 0.0F) view.captured.samples()[n] = 0.0F;  // its outline
    views.insert(views.begin() + 1, std::move(view));
  }
  for (DipoleView& view : views) compare(view);
  return views;
}

Image<float> enlarged(const Image<float>& picture, int times) {
  Image<float> large(picture.width() * times, picture.height() * times, picture.channels());
  for (int y = 0; y < large.height(); ++y)
    for (int x = 0; x < large.width(); ++x)
      for (int k = 0; k < large.channels(); ++k)
        large.at(x, y, k) = picture.at(x / times, y / times, k);
  return large;
}

Image<float> beside(const Image<float>& left, const Image<float>& right) {
  Image<float> both(left.width() + right.width(), std::max(left.height(), right.height()), 3);
  put(left, 0, both);
  put(right, left.width(), both);
  return both;
}

}  // namespace opaline::daemon
