#include "capture/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <string_view>

namespace opaline::capture {
namespace {

struct Signal {
  double value = 0.0;
  double slope = 1.0;  ///< d value / d fraction
};

Signal from_table(const std::vector<double>& table, double fraction) {
  const double intervals = static_cast<double>(table.size() - 1);
  const double place = fraction * intervals;
  const auto i = static_cast<std::size_t>(std::clamp(std::floor(place), 0.0, intervals - 1.0));
  const double step = table[i + 1] - table[i];
  return {table[i] + step * (place - static_cast<double>(i)), step * intervals};
}

// Odd about black, so that noise about zero stays without bias.
Signal from_gamma(double gamma, double fraction) {
  const double size = std::max(std::abs(fraction), 1e-3);  // keeps the slope finite
  return {std::copysign(std::pow(std::abs(fraction), gamma), fraction),
          gamma * std::pow(size, gamma - 1.0)};
}

Signal signal_of(const ResponseCurve& curve, double fraction) {
  switch (curve.kind) {
    case ResponseCurve::Kind::kGamma:
      return from_gamma(curve.gamma, fraction);
    case ResponseCurve::Kind::kTable:
      return from_table(curve.table, fraction);
    case ResponseCurve::Kind::kLinear:
      break;
  }
  return {fraction, 1.0};
}

struct Check {
  bool good;
  std::string_view name;
  double value;
  std::string_view expected;
};

Result<void> all_good(std::initializer_list<Check> checks) {
  for (const Check& check : checks) {
    if (check.good) continue;
    return invalid_argument(
        fmt::format("calibration.{} = {}; expected {}", check.name, check.value, check.expected));
  }
  return ok();
}

Result<void> check_curve(const ResponseCurve& curve) {
  if (curve.kind == ResponseCurve::Kind::kGamma && !(curve.gamma > 0.0)) {
    return invalid_argument(
        fmt::format("calibration.camera.response gamma = {}; expected > 0", curve.gamma));
  }
  if (curve.kind != ResponseCurve::Kind::kTable) return ok();
  const auto& table = curve.table;
  const bool rises = std::ranges::adjacent_find(table, std::greater_equal<>()) == table.end();
  if (table.size() < 2 || table.front() != 0.0 || table.back() != 1.0 || !rises) {
    return invalid_argument(
        "calibration.camera.response table: expected two or more values that rise from 0 to 1");
  }
  return ok();
}

bool positive(const std::array<double, 3>& values) {
  return std::ranges::all_of(values, [](double v) { return std::isfinite(v) && v > 0.0; });
}

}  // namespace

double Vignetting::at(double r_squared) const {
  const auto& c = coefficients;
  return 1.0 + r_squared * (c[0] + r_squared * (c[1] + r_squared * c[2]));
}

double Vignetting::least() const {
  double least = std::min(at(0.0), at(1.0));
  // Where its slope in r^2 is 0:  c0 + 2 c1 s + 3 c2 s^2 = 0.
  const double a = 3.0 * coefficients[2];
  const double b = coefficients[1];
  const double c = coefficients[0];
  const double root = std::sqrt(std::max(0.0, b * b - a * c));
  for (const double s : {(-b + root) / a, (-b - root) / a, -0.5 * c / b}) {
    if (s > 0.0 && s < 1.0) least = std::min(least, at(s));  // false for what is not finite
  }
  return least;
}

double ProjectorCalibration::vignetting_at(int x, int y) const {
  const double cx = 0.5 * width;
  const double cy = 0.5 * height;
  const double dx = x + 0.5 - cx;
  const double dy = y + 0.5 - cy;
  return vignetting.at((dx * dx + dy * dy) / (cx * cx + cy * cy));
}

double ProjectorCalibration::light_of(int code) const {
  return code == 0 ? 0.0 : (1.0 - black_level) * std::pow(code / 255.0, gamma);
}

Result<void> validate(const StationCalibration& calibration) {
  const CameraCalibration& c = calibration.camera;
  const ProjectorCalibration& p = calibration.projector;
  if (auto curve = check_curve(c.response); !curve) return curve;
  const double black = c.black_level;
  return all_good({
      {c.model.width > 0 && c.model.height > 0, "camera.width", 1.0 * c.model.width, "a size > 0"},
      {c.model.fx > 0.0 && c.model.fy > 0.0, "camera.fx", c.model.fx, "> 0"},
      {c.bit_depth >= 8 && c.bit_depth <= 16, "camera.bit_depth", 1.0 * c.bit_depth, "8 to 16"},
      {black >= 0.0 && black < c.max_code(), "camera.black_level", black, ">= 0, below full scale"},
      {c.gain_electrons_per_code > 0.0, "camera.gain", c.gain_electrons_per_code, "> 0"},
      {c.full_well_electrons >= 0.0, "camera.full_well", c.full_well_electrons, ">= 0"},
      {std::ranges::all_of(
           c.exposure_factors,
           [](const ExposureFactor& f) { return f.reported_s > 0.0 && f.factor > 0.0; }),
       "camera.exposure_factors",
       c.exposure_factors.empty() ? 1.0 : c.exposure_factors.front().factor,
       "seconds and factors > 0"},
      {c.read_noise_electrons >= 0.0, "camera.read_noise", c.read_noise_electrons, ">= 0"},
      {c.vignetting.least() > 0.0,
       "camera.vignetting",
       c.vignetting.least(),
       "light all over the picture"},
      {positive(c.sensitivity), "camera.sensitivity", c.sensitivity[0], "> 0 in each channel"},
      {p.width > 0 && p.height > 0, "projector.width", 1.0 * p.width, "a size > 0"},
      {p.mm_per_pixel > 0.0, "projector.mm_per_pixel", p.mm_per_pixel, "> 0"},
      {p.kind == ProjectorKind::kPerpendicular || (p.lens.fx > 0.0 && p.lens.fy > 0.0),
       "projector.lens.fx",
       p.lens.fx,
       "> 0"},
      {p.kind == ProjectorKind::kPerpendicular ||
           (p.lens.width == p.width && p.lens.height == p.height),
       "projector.lens.width",
       1.0 * p.lens.width,
       "the picture's"},
      {p.reference_distance_mm > 0.0,
       "projector.reference_distance",
       p.reference_distance_mm,
       "> 0"},
      {p.gamma > 0.0, "projector.gamma", p.gamma, "> 0"},
      {p.black_level >= 0.0 && p.black_level < 1.0,
       "projector.black_level",
       p.black_level,
       "0 or more, below 1"},
      {p.vignetting.least() > 0.0,
       "projector.vignetting",
       p.vignetting.least(),
       "light all over the picture"},
      {positive(p.peak_irradiance),
       "projector.peak_irradiance",
       p.peak_irradiance[0],
       "> 0 in each channel"},
  });
}

Electrons electrons_from_code(const CameraCalibration& camera, double code) {
  const double range = camera.max_code() - camera.black_level;
  const Signal signal = signal_of(camera.response, (code - camera.black_level) / range);
  const double full_scale = camera.full_scale_electrons();
  return {signal.value * full_scale, signal.slope * full_scale / range};
}

double clipping_code(const CameraCalibration& camera) {
  const double full_well = camera.full_well_electrons;
  double high = camera.max_code();
  if (full_well <= 0.0 || full_well >= camera.full_scale_electrons()) return high;
  double low = camera.black_level;
  for (int i = 0; i < 40; ++i) {  // bisection: the response rises
    const double middle = 0.5 * (low + high);
    (electrons_from_code(camera, middle).signal < full_well ? low : high) = middle;
  }
  return high;
}

double exposed_seconds(const CameraCalibration& camera, double reported) {
  const auto& known = camera.exposure_factors;
  if (known.empty()) return reported;
  const auto above = std::ranges::lower_bound(known, reported, {}, &ExposureFactor::reported_s);
  if (above == known.begin()) return reported * above->factor;
  const ExposureFactor& below = *(above - 1);
  if (above == known.end()) return reported * below.factor;
  const double share =
      std::log(reported / below.reported_s) / std::log(above->reported_s / below.reported_s);
  return reported * (below.factor + share * (above->factor - below.factor));
}

Image<float> camera_vignetting(const CameraCalibration& camera) {
  Image<float> falloff(camera.model.width, camera.model.height, 1);
  const double cx = 0.5 * camera.model.width;
  const double cy = 0.5 * camera.model.height;
  const double corner = cx * cx + cy * cy;
  for (int y = 0; y < falloff.height(); ++y) {
    for (int x = 0; x < falloff.width(); ++x) {
      const double dx = x + 0.5 - cx;
      const double dy = y + 0.5 - cy;
      falloff.at(x, y) = static_cast<float>(camera.vignetting.at((dx * dx + dy * dy) / corner));
    }
  }
  return falloff;
}

}  // namespace opaline::capture
