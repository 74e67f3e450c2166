#include "sim/optics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/seconds.h"
#include "sim/options_check.h"

namespace opaline::sim {
namespace {

double polynomial(const std::array<double, 3>& v, double r2) {
  return 1.0 + r2 * (v[0] + r2 * (v[1] + r2 * v[2]));
}

/// Vignetting must not turn light negative at the corner (r = 1) or on the way there.
void check_vignetting(OptionsCheck& check, const std::array<double, 3>& v) {
  for (const double r2 : {0.25, 0.5, 0.75, 1.0}) {
    check.within("vignetting at radius " + fmt::format("{:.2f}", std::sqrt(r2)),
                 polynomial(v, r2),
                 0.0,
                 4.0);
  }
}

/// Seconds for which a channel's third of the wheel stood in the light since time zero.
double segment_seconds(double turn, int channel, double until) {
  const double turns = std::floor(until / turn);
  const double within = until - turns * turn - turn * channel / 3.0;
  return turns * turn / 3.0 + std::clamp(within, 0.0, turn / 3.0);
}

}  // namespace

std::array<float, 256> light_of_codes(const ProjectorOptics& options) {
  std::array<float, 256> light{};
  for (std::size_t code = 0; code < light.size(); ++code) {
    const double linear = std::pow(static_cast<double>(code) / 255.0, options.gamma);
    light[code] = static_cast<float>(options.black_level + (1.0 - options.black_level) * linear);
  }
  return light;
}

CameraModel demo_camera_model() {
  const double tilt = 10.0 * std::numbers::pi / 180.0;
  const Vec3 target{12.0, 12.0, 6.0};
  const Vec3 centre = target + Vec3{std::sin(tilt), 0.0, std::cos(tilt)} * 300.0;
  CameraModel model;
  model.width = model.height = 256;
  model.fx = model.fy = 2500.0;
  model.cx = model.cy = 128.0;
  model.distortion = {-0.08, 0.02, 1e-4, -1e-4, 0.0};
  model.camera_from_sample = look_at(centre, target, {0.0, 1.0, 0.0});
  return model;
}

CameraModel demo_projector_lens() {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Vec3 target{12.0, 12.0, 6.0};
  const Vec3 way = normalized({std::tan(4.0 * kDegree), -std::tan(7.0 * kDegree), 1.0});
  CameraModel lens;
  lens.width = 640;
  lens.height = 480;
  lens.fx = 3300.0;
  lens.fy = 3310.0;
  lens.cx = 325.0;
  lens.cy = 236.0;
  lens.distortion = {0.8, 0.0, 4e-4, -3e-4, 0.0};
  lens.camera_from_sample = look_at(target + way * 300.0, target, {0.0, 1.0, 0.0});
  return lens;
}

Result<void> validate(const CameraOptics& o) {
  OptionsCheck check;
  check.within("model.width", o.model.width, 1, 8192)
      .within("model.height", o.model.height, 1, 8192);
  check.above("model.fx", o.model.fx, 0.0).above("model.fy", o.model.fy, 0.0);
  check.within("psf_sigma_px", o.psf_sigma_px, 0.0, 20.0);
  check_vignetting(check, o.vignetting);
  for (const double sensitivity : o.sensitivity) check.above("sensitivity", sensitivity, 0.0);
  check.above("full_well_electrons", o.full_well_electrons, 0.0);
  check.above("gain_electrons_per_code", o.gain_electrons_per_code, 0.0);
  check.at_least("read_noise_electrons", o.read_noise_electrons, 0.0);
  check.at_least("dark_electrons_per_second", o.dark_electrons_per_second, 0.0);
  check.within("hot_pixel_fraction", o.hot_pixel_fraction, 0.0, 1.0);
  check.at_least("hot_pixel_electrons_per_second", o.hot_pixel_electrons_per_second, 0.0);
  check.within("response_gamma", o.response_gamma, 0.1, 10.0);
  check.within("bit_depth", o.bit_depth, 8, 16);
  check.within("black_level", o.black_level, 0.0, o.max_code() / 2.0);
  check.within("exposure_error", o.exposure_error, 0.0, 0.1);
  check.above("shortest_exposure (seconds)", seconds(o.shortest_exposure), 0.0);
  check.within("longest_exposure (seconds)",
               seconds(o.longest_exposure),
               seconds(o.shortest_exposure),
               3600.0);
  return check.result();
}

Result<void> validate(const ProjectorOptics& o) {
  OptionsCheck check;
  check.within("width", o.width, 1, 8192).within("height", o.height, 1, 8192);
  check.above("mm_per_pixel", o.mm_per_pixel, 0.0);
  if (o.kind == ProjectorKind::kPerspective) {
    check.above("lens.fx", o.lens.fx, 0.0).above("lens.fy", o.lens.fy, 0.0);
    check.within("lens.width", o.lens.width, o.width, o.width)
        .within("lens.height", o.lens.height, o.height, o.height);
    check.above("reference_distance_mm", o.reference_distance_mm, 0.0);
  }
  check.within("gamma", o.gamma, 0.1, 10.0);
  check.within("black_level", o.black_level, 0.0, 1.0);
  check_vignetting(check, o.vignetting);
  for (const double peak : o.peak_irradiance) check.above("peak_irradiance", peak, 0.0);
  check.within("latency (seconds)", seconds(o.latency), 0.0, 1.0);
  check.within("wheel_turn (seconds)", seconds(o.wheel_turn), 1e-6, 1.0);
  return check.result();
}

Image<float> vignetting_map(int width, int height, const std::array<double, 3>& coefficients) {
  Image<float> map(width, height, 1);
  const double half_diagonal2 = 0.25 * (1.0 * width * width + 1.0 * height * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = x + 0.5 - 0.5 * width;
      const double dy = y + 0.5 - 0.5 * height;
      map.at(x, y) =
          static_cast<float>(polynomial(coefficients, (dx * dx + dy * dy) / half_diagonal2));
    }
  }
  return map;
}

Rgb wheel_lit_seconds(double turn_seconds, double from_seconds, double to_seconds) {
  Rgb lit{};
  for (int c = 0; c < 3; ++c) {
    lit[c] = 3.0 * (segment_seconds(turn_seconds, c, to_seconds) -
                    segment_seconds(turn_seconds, c, from_seconds));
  }
  return lit;
}

}  // namespace opaline::sim
