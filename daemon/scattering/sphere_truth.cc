#include "daemon/scattering/sphere_truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/led_blob.h"

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

SphereTruth compare_with_truth(const SphereMaps& maps,
                               const Image<std::uint8_t>& measured,
                               const StageRecord& record,
                               const config::RigConfig& rig) {
  const sim::LedSphereOptions& options = rig.sim.balls;
  SphereTruth truth;
  const auto object = sim::LedTruth::create(options);
  if (!object) return truth;  // such a rig does not start
  std::vector<std::vector<double>> diffusion(3 * object->objects());
  std::vector<std::vector<double>> albedo(3 * object->objects());
  for (std::size_t b = 0; b < object->objects(); ++b)
    for (std::size_t c = 0; c < 3; ++c)
      truth.balls.push_back(
          {.radius_mm = object->radius_mm(b),
           .channel = static_cast<int>(c),
           .diffusion_mm = sim::diffusion_of(options.reduced_albedo[c], options.translucency_mm[c]),
           .reduced_albedo = options.reduced_albedo[c]});
  const Image<float> normals = mean_normals(maps);
  double degrees = 0.0;
  int seen_pixels = 0;
  for (int y = 0; y < measured.height(); ++y)
    for (int x = 0; x < measured.width(); ++x) {
      if (measured.at(x, y) != reconstruct::kMeasured) continue;
      const auto seen = object->at(rig.sim.rig.camera.model, x + 0.5, y + 0.5);
      if (!seen) continue;
      double cosine = 0.0;
      for (std::size_t k = 0; k < 3; ++k)
        cosine += normals.at(x, y, static_cast<int>(k)) * dot(seen->normal, record.axes[k]);
      degrees += std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
      ++seen_pixels;
      const std::size_t at = static_cast<std::size_t>(y) * measured.width() + x;
      for (std::size_t c = 0; c < 3; ++c) {
        const reconstruct::ScatteringMaps& m = maps.channels[c];
        const std::size_t n = 3 * seen->object + c;
        BallErrors& ball = truth.balls[n];
        ++ball.seen;
        if (m.left_out[at] != LeftOut::kFound) continue;
        ++ball.found;
        // relative to the place's own truth, where there are two materials
        diffusion[n].push_back(m.diffusion[at] / seen->diffusion_mm[c] * ball.diffusion_mm);
        albedo[n].push_back(m.reduced_albedo[at] / seen->reduced_albedo[c] * ball.reduced_albedo);
        const double off = std::abs(std::log(m.diffusion[at] / seen->diffusion_mm[c]));
        if (off < 2.0 * m.log_diffusion_deviation[at]) ball.within_two_sigma += 1.0;
      }
    }
  if (seen_pixels > 0) truth.mean_normal_error_deg = degrees / seen_pixels;
  for (std::size_t n = 0; n < truth.balls.size(); ++n) {
    BallErrors& ball = truth.balls[n];
    ball.median_diffusion = median(std::move(diffusion[n]));
    ball.median_albedo = median(std::move(albedo[n]));
    if (ball.found > 0) ball.within_two_sigma /= ball.found;
  }
  return truth;
}

}  // namespace opaline::daemon
