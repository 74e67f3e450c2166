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

/// Pixels along one axis that a patch covers, and how much of each.
struct Coverage {
  int first = 0;
  std::vector<double> share;
};

Coverage coverage(double from, double to, int size) {
  Coverage covered;
  covered.first = std::clamp(static_cast<int>(std::floor(from)), 0, size);
  const int end = std::clamp(static_cast<int>(std::ceil(to)), covered.first, size);
  for (int i = covered.first; i < end; ++i) {
    covered.share.push_back(std::max(0.0, std::min(to, i + 1.0) - std::max(from, 1.0 * i)));
  }
  return covered;
}

/// Irradiance of every projector pixel over the peak.
Image<float> relative_light(const ProjectorOptics& options, const Image<std::uint8_t>& codes) {
  const std::array<float, 256> light = light_of_codes(options);
  const Image<float> falloff = vignetting_map(codes.width(), codes.height(), options.vignetting);
  Image<float> picture(codes.width(), codes.height(), 3);
  for (std::size_t i = 0; i < picture.samples().size(); ++i) {
    picture.samples()[i] = light[codes.samples()[i]] * falloff.samples()[i / 3];
  }
  return picture;
}

Rgb sum_over(const Image<float>& picture, const Coverage& columns, const Coverage& rows) {
  Rgb sum{};
  for (std::size_t j = 0; j < rows.share.size(); ++j) {
    for (std::size_t i = 0; i < columns.share.size(); ++i) {
      const double share = rows.share[j] * columns.share[i];
      const int x = columns.first + static_cast<int>(i);
      const int y = rows.first + static_cast<int>(j);
      for (int c = 0; c < 3; ++c) sum[c] += share * picture.at(x, y, c);
    }
  }
  return sum;
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

std::vector<Rgb> patch_irradiance(const ProjectorOptics& options,
                                  const Block& block,
                                  Face lit_face,
                                  int patches_x,
                                  int patches_y,
                                  const Image<std::uint8_t>& codes) {
  const std::array<double, 3> size{block.size().x, block.size().y, block.size().z};
  const double width_px = size[axis_of(lit_face) == 0 ? 1 : 0] / options.mm_per_pixel / patches_x;
  const double height_px = size[axis_of(lit_face) == 2 ? 1 : 2] / options.mm_per_pixel / patches_y;
  const Image<float> light = relative_light(options, codes);
  std::vector<Rgb> patches;
  for (int row = 0; row < patches_y; ++row) {
    const double top = options.offset_y_px + row * height_px;
    const Coverage rows = coverage(top, top + height_px, codes.height());
    for (int column = 0; column < patches_x; ++column) {
      const double left = options.offset_x_px + column * width_px;
      Rgb mean = sum_over(light, coverage(left, left + width_px, codes.width()), rows);
      for (int c = 0; c < 3; ++c) mean[c] *= options.peak_irradiance[c] / (width_px * height_px);
      patches.push_back(mean);
    }
  }
  return patches;
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
