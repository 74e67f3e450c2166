#include "reconstruct/spherical_gradient/scattering_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/spherical_gradient/normal_softness.h"
#include "reconstruct/spherical_gradient/pixel_ratio.h"
#include "reconstruct/spherical_gradient/shape_reach.h"
#include "reconstruct/spherical_gradient/window_choice.h"

namespace opaline::reconstruct {
namespace {

/// What interpolation in the table adds to ln D: the error on balls that are not in it
/// (tests/reconstruct/spherical_gradient/ball_table_test.cc).
constexpr double kTableDeviation = 0.02;

/// The tilt that a camera's slanted look makes, as a depth in mean free paths, and what of it is not known (tests/reconstruct/spherical_gradient/camera_tilt_test.cc).
constexpr double kTiltDepth = 1.0;
constexpr double kTiltDeviation = 0.2;
/// What of the correction for two different principal curvatures is not known.
constexpr double kUnevenDeviation = 0.3;

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
  if (!(options.ratio_deviation >= 0.0 && options.reflectance_deviation >= 0.0))
    return invalid_argument("deviations; expected at least 0");
  return ok();
}

ScatteringMaps empty_maps(int width, int height) {
  ScatteringMaps maps;
  maps.width = width;
  maps.height = height;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (auto* map : {&maps.normal_x,
                    &maps.normal_y,
                    &maps.normal_z,
                    &maps.curvature,
                    &maps.reduced_albedo,
                    &maps.diffusion,
                    &maps.translucency,
                    &maps.reduced_scattering,
                    &maps.absorption,
                    &maps.log_diffusion_deviation,
                    &maps.albedo_deviation})
    map->assign(count, 0.0F);
  maps.left_out.assign(count, LeftOut::kNotMeasured);
  return maps;
}

/// Variance of a ratio against the table's flat one.
double ratio_variance(const WindowValues& w, const BallTable& table, const MapOptions& options) {
  const double of_table = table.ratio_deviation() * w.ratio;
  const double of_lamps = options.ratio_deviation * w.ratio;
  return w.ratio_variance + of_table * of_table + of_lamps * of_lamps;
}

double reflectance_variance(const WindowValues& w, const MapOptions& options) {
  const double shared = options.reflectance_deviation * w.reflectance;
  return w.reflectance_variance + shared * shared;
}

/// Half of what the lowest and the highest index make of ln (g k l_d), which is ln D, and of ln g.
struct IndexSpread {
  LeftOut reason = LeftOut::kFound;
  double log_diffusion = 0.0;
  double log_decay = 0.0;
};

/// `sure` deviations make a curvature below zero concave, `sigmas` one above zero worth a look.
LeftOut judge(const WindowValues& w, double flat, double variance, double sure, double sigmas) {
  if (w.count < 6) return LeftOut::kNotMeasured;
  const double deviation = std::sqrt(w.curvature_variance);
  if (w.curvature < -sure * deviation) return LeftOut::kConcave;
  if (w.curvature <= sigmas * deviation) return LeftOut::kTooFlat;
  if (w.ratio - flat <= sigmas * std::sqrt(variance)) return LeftOut::kBelowNoise;
  return LeftOut::kFound;
}

LeftOut reason_of(BallTable::End end) {
  switch (end) {
    case BallTable::End::kFound:
      return LeftOut::kFound;
    case BallTable::End::kFlat:
      return LeftOut::kBelowNoise;
    case BallTable::End::kTooTranslucent:
      return LeftOut::kTooTranslucent;
    default:
      return LeftOut::kBeyondTable;
  }
}

IndexSpread index_spread(const WindowValues& w, const MapOptions& options) {
  if (options.lower_index == nullptr || options.higher_index == nullptr) return {};
  const BallTable::Found low = options.lower_index->find(w.reflectance, w.ratio);
  const BallTable::Found high = options.higher_index->find(w.reflectance, w.ratio);
  for (const BallTable::Found& end : {low, high})
    if (end.end != BallTable::End::kFound) return {reason_of(end.end)};
  const double decay = 0.25 * std::log((1.0 - high.reduced_albedo) / (1.0 - low.reduced_albedo));
  return {LeftOut::kFound, decay + 0.5 * std::log(high.curvature / low.curvature), decay};
}

/// By how much the camera's slanted look makes a pixel's curvature too large, as a factor: `shift` is c of the header, `cosine` that of the normal found.
double curvature_by_tilt(double shift, double cosine) {
  constexpr double kRim = 0.5;  // beyond, windows see little of what bends most
  const double mu = std::clamp(cosine, kRim, 1.0);
  return std::max(0.5, 1.0 + shift * (mu - 0.5 * (1.0 - mu * mu) / mu));
}

/// Turns a pixel's normal back towards the camera.
void take_out_tilt(double shift, std::size_t at, ScatteringMaps& maps) {
  const double across = std::hypot(maps.normal_x[at], maps.normal_y[at]);
  if (!(across > 0.0 && across < 1.0)) return;
  const double turned = std::sin(std::asin(across) - shift * across);
  const double scale = std::max(0.0, turned) / across;
  maps.normal_x[at] = static_cast<float>(scale * maps.normal_x[at]);
  maps.normal_y[at] = static_cast<float>(scale * maps.normal_y[at]);
  maps.normal_z[at] = static_cast<float>(std::sqrt(1.0 - turned * turned));
}

/// What the pixel before found: neighbours in a cell of a large window find the same, others find it near.
class LastFound {
 public:
  void look_up(const BallTable& table, const WindowValues& w) {
    if (w.reflectance == window_.reflectance && w.ratio == window_.ratio &&
        w.unevenness == window_.unevenness && w.curvature == window_.curvature)
      return;
    window_ = w;
    found_ = table.find(w.reflectance, w.ratio, found_);
    if (found_.end == BallTable::End::kFound)
      bent_ = table.curvature_where(found_, w.unevenness / (w.curvature * w.curvature));
  }
  const BallTable::Found& found() const { return found_; }
  /// k l_d with both principal curvatures.
  double bent() const { return bent_; }

 private:
  WindowValues window_;
  BallTable::Found found_;
  double bent_ = 0.0;
};

void estimate_pixel(const WindowValues& w,
                    double pixel_mm,
                    const BallTable& table,
                    const MapOptions& options,
                    std::size_t at,
                    LastFound& last,
                    ScatteringMaps& maps) {
  last.look_up(table, w);
  const BallTable::Found& found = last.found();
  maps.left_out[at] = reason_of(found.end);
  if (found.end != BallTable::End::kFound) return;
  const IndexSpread index = index_spread(w, options);
  maps.left_out[at] = index.reason;
  if (index.reason != LeftOut::kFound) return;
  const double ratio_noise = ratio_variance(w, table, options);
  const double reflectance_noise = reflectance_variance(w, options);
  const double g = std::sqrt(3.0 * (1.0 - found.reduced_albedo));
  const double shift = kTiltDepth * g * last.bent() / options.ior;  // 3 D H / ior, times that
  const double by_tilt = curvature_by_tilt(shift, maps.normal_z[at]);
  const double curvature = w.curvature / pixel_mm / by_tilt;
  take_out_tilt(shift, at, maps);
  maps.curvature[at] = static_cast<float>(curvature);
  const double by_uneven = std::log(found.curvature / last.bent());
  const double translucency = last.bent() / curvature;
  const double diffusion = g * translucency / 3.0;
  const auto& s = found.sensitivity;
  const double by_reflectance = s[0] + s[2];
  const double by_ratio = s[1] + s[3];
  const double log_variance =
      by_reflectance * by_reflectance * reflectance_noise + by_ratio * by_ratio * ratio_noise +
      w.curvature_variance / (w.curvature * w.curvature) + kTableDeviation * kTableDeviation +
      kTiltDeviation * kTiltDeviation * (by_tilt - 1.0) * (by_tilt - 1.0) +
      kUnevenDeviation * kUnevenDeviation * by_uneven * by_uneven +
      index.log_diffusion * index.log_diffusion;
  const double decay_variance = s[0] * s[0] * reflectance_noise + s[1] * s[1] * ratio_noise +
                                index.log_decay * index.log_decay;
  maps.reduced_albedo[at] = static_cast<float>(found.reduced_albedo);
  maps.diffusion[at] = static_cast<float>(diffusion);
  maps.translucency[at] = static_cast<float>(translucency);
  maps.reduced_scattering[at] = static_cast<float>(found.reduced_albedo / (3.0 * diffusion));
  maps.absorption[at] = static_cast<float>((1.0 - found.reduced_albedo) / (3.0 * diffusion));
  maps.log_diffusion_deviation[at] = static_cast<float>(std::sqrt(log_variance));
  maps.albedo_deviation[at] =  // d alpha' = -2/3 g^2 d ln g
      static_cast<float>(2.0 / 3.0 * g * g * std::sqrt(decay_variance));
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
  ScatteringMaps maps = empty_maps(pictures.width, pictures.height);
  PixelValues values(pictures.width, pictures.height);
  const std::size_t count = values.measured.size();
  const auto share = [&](int thread) { return count * thread / team.size(); };
  team.run([&](int thread) {
    for (std::size_t at = share(thread); at < share(thread + 1); ++at)
      measure_pixel(pictures, at, values, maps);
  });
  const FlatRatios flat(table);
  const double sure = sure_deviations(values);
  const std::vector<WindowValues> windows = choose_windows(values, flat, options, team, maps);
  team.run([&](int thread) {
    LastFound last;
    for (std::size_t at = share(thread); at < share(thread + 1); ++at) {
      const WindowValues& window = windows[at];
      if (values.measured[at] == 0 || window.count < 6) continue;
      const double pixel_mm =
          pictures.pixel_mm * (pictures.pixel_scale.empty() ? 1.0 : pictures.pixel_scale[at]);
      maps.curvature[at] = static_cast<float>(window.curvature / pixel_mm);
      maps.left_out[at] = judge(window,
                                flat.at(window.reflectance),
                                ratio_variance(window, table, options),
                                sure,
                                options.sigmas);
      if (maps.left_out[at] == LeftOut::kFound)
        estimate_pixel(window, pixel_mm, table, options, at, last, maps);
    }
  });
  sharpen_normals(pictures, options.ior, team, maps);
  account_for_shape(pictures, team, maps);
  return maps;
}

}  // namespace opaline::reconstruct
