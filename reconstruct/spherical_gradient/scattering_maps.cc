#include "reconstruct/spherical_gradient/scattering_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "reconstruct/spherical_gradient/normal_softness.h"
#include "reconstruct/spherical_gradient/picture_arrays.h"
#include "reconstruct/spherical_gradient/pixel_ratio.h"
#include "reconstruct/spherical_gradient/shape_reach.h"
#include "reconstruct/spherical_gradient/window_answer.h"
#include "reconstruct/spherical_gradient/window_choice.h"

namespace opaline::reconstruct {
namespace {

/// What of the tilt that a camera's slanted look makes is not known (tests/reconstruct/spherical_gradient/camera_tilt_test.cc).
constexpr double kTiltDeviation = 0.2;

Result<void> check(const GradientPictures& p, const MapOptions& options) {
  if (p.width < 1 || p.height < 1)
    return invalid_argument(fmt::format("pictures of {} x {} pixels", p.width, p.height));
  const auto count = static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height);
  for (std::size_t n = 0; n < p.radiance.size(); ++n)
    if (p.radiance[n].size() != count || p.variance[n].size() != count)
      return invalid_argument(fmt::format("picture {} has {} values and {} variances for {} pixels",
                                          n,
                                          p.radiance[n].size(),
                                          p.variance[n].size(),
                                          count));
  if (p.measured.size() != count)
    return invalid_argument(fmt::format("a mask of {} for {} pixels", p.measured.size(), count));
  if (!(p.pixel_mm > 0.0 && std::isfinite(p.pixel_mm)))
    return invalid_argument(fmt::format("pixels of {} mm; expected > 0", p.pixel_mm));
  if (!p.pixel_scale.empty() && p.pixel_scale.size() != count)
    return invalid_argument(
        fmt::format("{} pixel scales for {} pixels", p.pixel_scale.size(), count));
  if (!(p.white > 0.0 && std::isfinite(p.white)))
    return invalid_argument(fmt::format("white of {}; expected > 0", p.white));
  if (options.half_windows.empty() ||
      !std::is_sorted(options.half_windows.begin(), options.half_windows.end()) ||
      options.half_windows.front() < 1 || options.half_windows.back() > 1000)
    return invalid_argument("half windows; expected 1 to 1000 pixels, in rising order");
  if (!(options.certain > 0.0 && options.sigmas >= 0.0 && options.normal_certain > 0.0 &&
        options.agree > 0.0))
    return invalid_argument("certainty, agreement and sigmas; expected > 0");
  if (!(options.ior >= 1.0 && options.ior <= 3.0))
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", options.ior));
  if (!(options.shared.ratio >= 0.0 && options.shared.reflectance >= 0.0 &&
        options.shared.curvature >= 0.0))
    return invalid_argument("deviations; expected at least 0");
  return ok();
}

ScatteringMaps empty_maps(int width, int height, ThreadTeam& team) {
  ScatteringMaps maps;
  maps.width = width;
  maps.height = height;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  assign_zeros({&maps.normal_x,
                &maps.normal_y,
                &maps.normal_z,
                &maps.curvature,
                &maps.curvature_deviation,
                &maps.reduced_albedo,
                &maps.diffusion,
                &maps.translucency,
                &maps.reduced_scattering,
                &maps.absorption,
                &maps.log_diffusion_deviation,
                &maps.albedo_deviation},
               count,
               team);
  maps.left_out.assign(count, LeftOut::kNotMeasured);
  return maps;
}

/// By how much the camera's slanted look makes a pixel's curvature too large, as a factor: `shift` is c of the header, `cosine` that of the normal found.
double curvature_by_tilt(double shift, double cosine) {
  constexpr double kRim = 0.5;  // beyond, windows see little of what bends most
  const double mu = std::clamp(cosine, kRim, 1.0);
  return std::max(0.5, 1.0 + shift * (mu - 0.5 * (1.0 - mu * mu) / mu));
}

/// Turns a pixel's normal back towards the camera.
void take_out_tilt(double shift, std::size_t at, ScatteringMaps& maps) {
  const float nx = maps.normal_x[at];
  const float ny = maps.normal_y[at];
  const float across = std::sqrt(nx * nx + ny * ny);
  if (!(across > 0.0F && across < 1.0F)) return;
  const float turned = std::sin(std::asin(across) - static_cast<float>(shift) * across);
  const float scale = std::max(0.0F, turned) / across;
  maps.normal_x[at] = scale * nx;
  maps.normal_y[at] = scale * ny;
  maps.normal_z[at] = std::sqrt(1.0F - turned * turned);
}

void put_answer(const WindowValues& w,
                const WindowAnswer& a,
                double pixel_mm,
                std::size_t at,
                ScatteringMaps& maps) {
  maps.left_out[at] = a.reason;
  maps.curvature[at] = static_cast<float>(w.curvature / pixel_mm);
  const double deviation = std::sqrt(w.curvature_variance) / pixel_mm;
  maps.curvature_deviation[at] = static_cast<float>(deviation);
  if (a.reason != LeftOut::kFound) return;
  const double by_tilt = curvature_by_tilt(a.shift, maps.normal_z[at]);
  const double curvature = w.curvature / pixel_mm / by_tilt;
  take_out_tilt(a.shift, at, maps);
  const double translucency = a.bent / curvature;
  const double diffusion = a.decay * translucency / 3.0;
  const double extinction = 1.0 / (3.0 * diffusion);
  const double of_tilt = kTiltDeviation * (by_tilt - 1.0);
  maps.curvature[at] = static_cast<float>(curvature);
  maps.curvature_deviation[at] = static_cast<float>(deviation / by_tilt);
  maps.reduced_albedo[at] = static_cast<float>(a.reduced_albedo);
  maps.diffusion[at] = static_cast<float>(diffusion);
  maps.translucency[at] = static_cast<float>(translucency);
  maps.reduced_scattering[at] = static_cast<float>(a.reduced_albedo * extinction);
  maps.absorption[at] = static_cast<float>((1.0 - a.reduced_albedo) * extinction);
  maps.log_diffusion_deviation[at] =
      static_cast<float>(std::sqrt(a.log_variance + of_tilt * of_tilt));
  maps.albedo_deviation[at] = static_cast<float>(a.albedo_deviation);
}

/// Rows of pixels from `begin` to `end`, in the order of the largest windows' cells.
void estimate_rows(const GradientPictures& pictures,
                   const PixelValues& values,
                   WindowAnswers answers,
                   WindowChooser chooser,
                   int band,
                   std::array<int, 2> rows,
                   ScatteringMaps& maps) {
  for (int top = rows[0]; top < rows[1]; top += band) {
    const std::span<const WindowValues> windows = chooser.next();
    const std::size_t first = values.index(0, top);
    for (int left = 0; left < values.width; left += band)
      for (int y = top; y < std::min(rows[1], top + band); ++y)
        for (int x = left; x < std::min(values.width, left + band); ++x) {
          const std::size_t at = values.index(x, y);
          const WindowValues& window = windows[at - first];
          if (values.measured[at] == 0 || window.count < 6) continue;
          const double scale = pictures.pixel_scale.empty() ? 1.0 : pictures.pixel_scale[at];
          put_answer(window, answers.of(window), pictures.pixel_mm * scale, at, maps);
        }
  }
}

}  // namespace

std::string_view to_string(LeftOut reason) {
  switch (reason) {
    case LeftOut::kFound:
      return "found";
    case LeftOut::kNotMeasured:
      return "not measured";
    case LeftOut::kSaturated:
      return "saturated";
    case LeftOut::kTooFlat:
      return "too flat";
    case LeftOut::kConcave:
      return "concave";
    case LeftOut::kBelowNoise:
      return "below the noise";
    case LeftOut::kTooTranslucent:
      return "too translucent for its curvature";
    case LeftOut::kBeyondTable:
      return "beyond the table";
    case LeftOut::kInterreflection:
      return "lit by a concave place";
    case LeftOut::kUneven:
      return "bent too unevenly";
  }
  return "unknown";
}

Result<ScatteringMaps> estimate_scattering(const GradientPictures& pictures,
                                           const BallTable& table,
                                           const MapOptions& options,
                                           ThreadTeam& team) {
  if (Result<void> good = check(pictures, options); !good) return good.error();
  ScatteringMaps maps = empty_maps(pictures.width, pictures.height, team);
  PixelValues values(pictures.width, pictures.height, team);
  const std::size_t count = values.measured.size();
  const auto share = [&](int thread) { return count * thread / team.size(); };
  team.run([&](int thread) {
    for (std::size_t at = share(thread); at < share(thread + 1); ++at)
      measure_pixel(pictures, at, values, maps);
  });
  const FlatRatios flat(table);
  const double sure = sure_deviations(values);
  const int band = WindowChooser::rows_of_band(options);
  const int bands = (pictures.height + band - 1) / band;
  team.run([&](int thread) {
    const int begin = bands * thread / team.size() * band;
    const int end = std::min(pictures.height, bands * (thread + 1) / team.size() * band);
    estimate_rows(pictures,
                  values,
                  {table, flat, options, sure},
                  {values, flat, options, sure, begin, maps},
                  band,
                  {begin, end},
                  maps);
  });
  sharpen_normals(pictures, options.ior, team, maps);
  account_for_shape(pictures, team, maps);
  return maps;
}

}  // namespace opaline::reconstruct
