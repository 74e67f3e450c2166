#include "daemon/scattering/turned_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <thread>

#include "base/files.h"
#include "reconstruct/spherical_gradient/exit_law.h"

namespace opaline::daemon {
namespace {

constexpr int kMostPixels = 144;  // of the longer side
constexpr double kMargin = 1.05;
constexpr std::size_t kLargestMesh = std::size_t{1} << 30;

Result<render::TexturedMesh> mesh_of(const Relief& relief, const TurnedViewOptions& options) {
  if (options.mesh.empty()) return render::decode_textured_obj(relief_obj(relief));
  const auto bytes = read_bytes(options.mesh, kLargestMesh);
  if (!bytes) return bytes.error();
  auto mesh =
      render::decode_textured_obj({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!mesh) return mesh.error().in(options.mesh.string());
  return mesh;
}

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

/// Turned about the vertical and moved into the middle of a picture that holds it.
render::ParallelView view_of(const render::TexturedMesh& mesh, double turn_deg) {
  const double turn = turn_deg * std::numbers::pi / 180.0;
  render::ParallelView view;
  view.view_from_mesh.rotation = {
      std::cos(turn), 0.0, std::sin(turn), 0.0, 1.0, 0.0, -std::sin(turn), 0.0, std::cos(turn)};
  const Box box = box_of(mesh, view.view_from_mesh);
  view.view_from_mesh.translation = box.middle() * -1.0;
  const Vec3 across = box.high - box.low;
  view.pixel_mm = kMargin * std::max(across.x, across.y) / kMostPixels;
  view.width = std::max(8, static_cast<int>(kMargin * across.x / view.pixel_mm));
  view.height = std::max(8, static_cast<int>(kMargin * across.y / view.pixel_mm));
  return view;
}

class Drawer {
 public:
  Drawer(const SphereMaps& maps, const Relief& relief, double ior)
      : maps_(maps), relief_(relief), ior_(ior), law_(ior) {}

  /// Into one picture for each light.
  Result<void> draw(const render::TexturedMesh& mesh,
                    const render::ParallelView& view,
                    std::span<const render::LinearLight> lights,
                    std::span<Image<float>* const> pictures,
                    const std::stop_token& stop) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto known = nearest_maps(relief_, maps_.channels[c]);
      if (!known) return known.error();
      const auto texels = render::texels_of_view(
          mesh, {relief_.width, relief_.height, known->reduced_albedo, known->diffusion}, view);
      if (!texels) return texels.error();
      for (std::size_t n = 0; n < lights.size(); ++n) {
        if (stop.stop_requested()) return cancelled("dipole rendering: stopped");
        const auto exitance = render::diffuse_texels(*texels, lights[n], ior_, team_);
        if (!exitance) return exitance.error();
        for (std::size_t at = 0; at < exitance->size(); ++at)
          if (texels->covered[at] != 0)
            pictures[n]->samples()[3 * at + c] = static_cast<float>(
                (*exitance)[at] / std::numbers::pi * law_.at(texels->normal[at].z));
      }
    }
    return ok();
  }

 private:
  const SphereMaps& maps_;
  const Relief& relief_;
  double ior_;
  reconstruct::ExitLaw law_;
  ThreadTeam team_{static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))};
};

}  // namespace

Result<TurnedView> turned_view(const SphereMaps& maps,
                               const SphereSession& session,
                               const TurnedViewOptions& options,
                               double ior,
                               std::stop_token stop) {
  const Relief relief = relief_of(maps, session);
  auto mesh = mesh_of(relief, options);
  if (!mesh) return mesh.error();
  if (options.mesh_size_mm > 0.0) {
    const double scale = options.mesh_size_mm / box_of(*mesh, {}).extent();
    for (auto& corner : mesh->corners) corner.position = corner.position * scale;
  }
  const render::ParallelView view = view_of(*mesh, options.turn_deg);
  TurnedView turned{Image<float>(view.width, view.height, 3),
                    Image<float>(view.width, view.height, 3),
                    view.pixel_mm};
  const std::array lights{render::LinearLight{1.0, {}}, render::LinearLight{0.5, {-0.5, 0.0, 0.0}}};
  const std::array<Image<float>*, 2> pictures{&turned.even, &turned.from_left};
  if (auto drawn = Drawer(maps, relief, ior).draw(*mesh, view, lights, pictures, stop); !drawn)
    return drawn.error();
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
  if (auto drawn = Drawer(maps, relief, ior).draw(*mesh, view, lights, pictures, stop); !drawn)
    return drawn.error();
  return picture;
}

}  // namespace opaline::daemon
