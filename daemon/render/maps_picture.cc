#include "daemon/render/maps_picture.h"

#include <algorithm>
#include <utility>

#include "base/files.h"
#include "daemon/render/developed_picture.h"
#include "daemon/render/turntable.h"
#include "daemon/scattering/dipole_view.h"
#include "daemon/scattering/maps_scene.h"

namespace opaline::daemon {
namespace {

constexpr int kHeight = 480;  // pixels, about
constexpr int kTurnedPixels = 160;

Image<float> to_height(const Image<float>& picture) {
  return enlarged(picture, std::max(1, kHeight / std::max(1, picture.height())));
}

/// With the covered share as a fourth channel.
Image<float> with_cover(const Image<float>& picture) {
  Image<float> out(picture.width(), picture.height(), 4);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      float most = 0.0F;
      for (int c = 0; c < 3; ++c) most = std::max(most, out.at(x, y, c) = picture.at(x, y, c));
      out.at(x, y, 3) = most > 0.0F ? 1.0F : 0.0F;
    }
  return out;
}

Result<Image<float>> one_picture(MapsScene& scene,
                                 const MapsPictureOptions& o,
                                 double turn_deg,
                                 const std::stop_token& stop) {
  const auto light = light_of_pattern(o.light);
  if (!light) return light.error();
  if (o.turntable == 0 && !scene.has_mesh() && turn_deg == 0.0 && o.tilt_deg == 0.0) {
    const auto rendered = scene.rendered(*light, stop);
    if (!rendered) return rendered.error();
    return beside(to_height(scene.captured(*light)), to_height(*rendered));
  }
  const auto turned = scene.turned(turn_deg, o.tilt_deg, *light, kTurnedPixels, stop);
  if (!turned) return turned.error();
  if (o.turntable > 0 || scene.has_mesh()) return to_height(*turned);
  return beside(to_height(scene.captured(*light)), to_height(*turned));
}

}  // namespace

Result<void> draw_maps(const MapsPictureOptions& o,
                       const std::function<void(const std::filesystem::path&)>& told,
                       std::stop_token stop) {
  TurnedViewOptions view;
  view.mesh = o.mesh;
  view.mesh_size_mm = o.mesh_size_mm;
  auto scene = MapsScene::open(o.session, view);
  if (!scene) return scene.error();
  const int pictures = std::max(1, o.turntable);
  double white = 0.0;
  for (int k = 0; k < pictures; ++k) {
    const auto drawn = one_picture(*scene, o, o.turn_deg + 360.0 * k / pictures, stop);
    if (!drawn) return drawn.error();
    const Image<float> covered = with_cover(*drawn);
    if (k == 0) white = white_of(covered, {});
    for (const std::filesystem::path& output : o.outputs) {
      const auto format = image_format_of(output.string());
      if (!format) return format.error();
      const auto bytes = developed(covered, white, {}, *format);
      if (!bytes) return bytes.error().in(output.string());
      const auto file = numbered(output, k, pictures);
      if (auto written = write_whole(system_files(), file, *bytes); !written) return written;
      told(file);
    }
  }
  return ok();
}

}  // namespace opaline::daemon
