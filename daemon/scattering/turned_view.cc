#include "daemon/scattering/turned_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include "base/files.h"
#include "reconstruct/spherical_gradient/exit_law.h"

namespace opaline::daemon {
namespace {

constexpr double kMargin = 1.05;
constexpr std::size_t kLargestMesh = std::size_t{1} << 30;

struct Box {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Vec3 high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(Vec3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Vec3 middle() const { return (low + high) * 0.5; }
  double extent() const {
    const Vec3 across = high - low;
    return std::max({across.x, across.y, across.z});
  }
};

Box box_of(const render::TexturedMesh& mesh, const Pose& pose) {
  Box box;
  for (const auto& corner : mesh.corners) box.add(pose.apply(corner.position));
  return box;
}

std::array<double, 9> turned_by(double right_deg, double up_deg) {
  const double right = right_deg * std::numbers::pi / 180.0;
  const double up = up_deg * std::numbers::pi / 180.0;
  const double c = std::cos(right);
  const double s = std::sin(right);
  const double cu = std::cos(up);
  const double su = std::sin(up);
  return {c, 0.0, s, su * s, cu, -su * c, -cu * s, su, cu * c};
}

}  // namespace

Result<render::TexturedMesh> mesh_of(const Relief& relief, const TurnedViewOptions& options) {
  if (options.mesh.empty()) return render::decode_textured_obj(relief_obj(relief));
  const auto bytes = read_bytes(options.mesh, kLargestMesh);
  if (!bytes) return bytes.error();
  auto mesh =
      render::decode_textured_obj({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!mesh) return mesh.error().in(options.mesh.string());
  if (options.mesh_size_mm > 0.0) {
    const double scale = options.mesh_size_mm / box_of(*mesh, {}).extent();
    for (auto& corner : mesh->corners) corner.position = corner.position * scale;
  }
  return mesh;
}

render::ParallelView view_of(const render::TexturedMesh& mesh, const TurnedViewOptions& options) {
  render::ParallelView view;
  view.view_from_mesh.rotation = turned_by(options.turn_deg, options.tilt_deg);
  const Box box = box_of(mesh, view.view_from_mesh);
  view.view_from_mesh.translation = box.middle() * -1.0;
  const Vec3 across = box.high - box.low;
  view.pixel_mm = kMargin * std::max(across.x, across.y) / options.most_pixels;
  view.width = std::max(8, static_cast<int>(kMargin * across.x / view.pixel_mm));
  view.height = std::max(8, static_cast<int>(kMargin * across.y / view.pixel_mm));
  return view;
}

Result<void> draw_in_screen_space(const SphereMaps& maps,
                                  const Relief& relief,
                                  double ior,
                                  const render::TexturedMesh& mesh,
                                  const render::ParallelView& view,
                                  std::span<const render::LinearLight> lights,
                                  std::span<Image<float>* const> pictures,
                                  std::stop_token stop) {
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  const reconstruct::ExitLaw law(ior);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto known = nearest_maps(relief, maps.channels[c]);
    if (!known) return known.error();
    const auto texels = render::texels_of_view(
        mesh, {relief.width, relief.height, known->reduced_albedo, known->diffusion}, view);
    if (!texels) return texels.error();
    for (std::size_t n = 0; n < lights.size(); ++n) {
      if (stop.stop_requested()) return cancelled("dipole rendering: stopped");
      const auto exitance = render::diffuse_texels(*texels, lights[n], ior, team);
      if (!exitance) return exitance.error();
      for (std::size_t at = 0; at < exitance->size(); ++at)
        if (texels->covered[at] != 0)
          pictures[n]->samples()[3 * at + c] =
              static_cast<float>((*exitance)[at] / std::numbers::pi * law.at(texels->normal[at].z));
    }
  }
  return ok();
}

Result<TurnedPictures> turned_view(const SphereMaps& maps,
                                   const SphereSession& session,
                                   const TurnedViewOptions& options,
                                   double ior,
                                   std::stop_token stop) {
  const Relief relief = relief_of(maps, session);
  auto mesh = mesh_of(relief, options);
  if (!mesh) return mesh.error();
  const render::ParallelView view = view_of(*mesh, options);
  TurnedPictures turned{Image<float>(view.width, view.height, 3),
                        Image<float>(view.width, view.height, 3),
                        view.pixel_mm};
  const std::array lights{render::LinearLight{1.0, {}}, render::LinearLight{0.5, {-0.5, 0.0, 0.0}}};
  const std::array<Image<float>*, 2> pictures{&turned.even, &turned.from_left};
  auto drawn =
      draw_in_screen_space(maps, relief, ior, *mesh, view, lights, pictures, std::move(stop));
  if (!drawn) return drawn.error();
  return turned;
}

Result<Image<float>> captured_view_in_screen_space(const SphereMaps& maps,
                                                   const Relief& relief,
                                                   double ior,
                                                   std::stop_token stop) {
  const auto mesh = render::decode_textured_obj(relief_obj(relief));
  if (!mesh) return mesh.error();
  render::ParallelView view;
  view.width = relief.width;
  view.height = relief.height;
  view.pixel_mm = relief.cell_mm;
  Image<float> picture(view.width, view.height, 3);
  const std::array lights{render::LinearLight{1.0, {}}};
  const std::array<Image<float>*, 1> pictures{&picture};
  auto drawn =
      draw_in_screen_space(maps, relief, ior, *mesh, view, lights, pictures, std::move(stop));
  if (!drawn) return drawn.error();
  return picture;
}

}  // namespace opaline::daemon
