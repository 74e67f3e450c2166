#include "daemon/report/surface_view.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "daemon/report/report_data.h"
#include "sim/surface_reflectance.h"

namespace opaline::daemon {
namespace {

Image<float> rgb_of(const Image<float>& rgba) {
  Image<float> rgb(rgba.width(), rgba.height(), kColorChannels);
  for (std::size_t i = 0; i < rgb.samples().size(); ++i)
    rgb.samples()[i] = rgba.samples()[i / 3 * 4 + i % 3];
  return rgb;
}

double median_of(const SurfaceReflectance& surface, int channel) {
  std::vector<float> values;
  for (std::size_t x = 0; x < surface.mask.samples().size(); ++x)
    if (surface.mask.samples()[x] != 0)
      values.push_back(surface.reflectance.samples()[kColorChannels * x + channel]);
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

double error_of(const SurfaceReflectance& surface, const Image<float>& truth, int channel) {
  double misfit = 0.0;
  double power = 0.0;
  const int rim = SurfaceView::kRim;
  for (int y = rim; y < truth.height() - rim; ++y) {
    for (int x = rim; x < truth.width() - rim; ++x) {
      if (surface.mask.at(x, y) == 0) continue;
      const double t = truth.at(x, y, channel);
      misfit += std::pow(surface.reflectance.at(x, y, channel) - t, 2);
      power += t * t;
    }
  }
  return power > 0.0 ? std::sqrt(misfit / power) : 0.0;
}

void compare_with_truth(const ReportData& data, SurfaceView& view) {
  const config::RigConfig& rig = data.config.rig;
  if (!rig.is_simulated() || !(rig.sim.rig.surface.reflectance > 0.0)) return;
  const SurfaceReflectance& surface = view.surface;
  const Image<float> truth =
      sim::surface_reflectance(rig.sim.rig.surface, surface.block, surface.face);
  view.has_truth = true;
  for (int c = 0; c < kColorChannels; ++c) view.error[c] = error_of(surface, truth, c);
}

}  // namespace

Result<SurfaceView> surface_view(render::Renderer& renderer,
                                 const ReportData& data,
                                 SurfaceReflectance surface,
                                 HdrPicture captured,
                                 const render::TranslucencyOptions& options,
                                 reconstruct::diffusion::FluenceSolver& solver,
                                 std::stop_token stop) {
  const CameraModel& camera = data.camera;
  const Image<float>& irradiance = data.dataset.uniform->irradiance;
  const render::Light whole{data.dataset.lit_face, irradiance};
  auto fields = render::illuminate(data.material, std::span(&whole, 1), options, solver, stop);
  if (!fields) return fields.error();
  render::SurfaceField& field = fields->front();
  const auto material = renderer.draw(field, camera, stop);
  if (!material) return material.error();
  field.faces[static_cast<std::size_t>(surface.face)].reflected =
      render::reflected(surface.reflectance, irradiance);
  const auto both = renderer.draw(field, camera, stop);
  if (!both) return both.error();
  SurfaceView view{
      std::move(captured.radiance), rgb_of(*material), rgb_of(*both), std::move(surface)};
  for (int c = 0; c < kColorChannels; ++c) view.median[c] = median_of(view.surface, c);
  compare_with_truth(data, view);
  return view;
}

}  // namespace opaline::daemon
