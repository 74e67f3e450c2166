#include "sim/led_sphere.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <thread>

#include "sim/led_beam.h"
#include "sim/options_check.h"
#include "sim/sensor.h"

namespace opaline::sim {
namespace {

using std::numbers::pi;

constexpr std::int64_t kTiltPaths = 200'000;

/// A normal turned away from the camera by `tilt` times the sine of the angle between them.
Vec3 turned_away(Vec3 normal, Vec3 to_camera, double tilt) {
  const Vec3 across = to_camera - normal * dot(normal, to_camera);
  const double sine = length(across);
  if (sine < 1e-9) return normal;
  return normal * std::cos(tilt * sine) - across * (std::sin(tilt * sine) / sine);
}

double decay(double reduced_albedo) { return std::sqrt(3.0 * (1.0 - reduced_albedo)); }

/// Where a ray first meets a ball; the distance along it.
std::optional<double> meet(Vec3 from, Vec3 way, const BallTruth& ball) {
  const Vec3 to = ball.centre - from;
  const double along = dot(to, way);
  const double missed = dot(to, to) - along * along;
  const double inside = ball.radius_mm * ball.radius_mm - missed;
  if (inside <= 0.0 || along <= 0.0) return std::nullopt;
  return along - std::sqrt(inside);
}

}  // namespace

Result<void> validate(const LedSphereOptions& o, std::size_t lights) {
  if (o.radii_mm.empty() || o.radii_mm.size() > 8)
    return invalid_argument(fmt::format("{} balls; expected 1 to 8", o.radii_mm.size()));
  OptionsCheck check;
  for (const double radius : o.radii_mm) check.above("radii", radius, 0.0);
  check.at_least("gap", o.gap_mm, 0.0);
  for (std::size_t c = 0; c < 3; ++c) {
    check.within("reduced_albedo", o.reduced_albedo[c], 0.0, 0.99999);
    check.above("translucency", o.translucency_mm[c], 0.0);
    check.within("second_reduced_albedo", o.second_reduced_albedo[c], 0.0, 0.99999);
    check.above("second_translucency", o.second_translucency_mm[c], 0.0);
  }
  check.within("ior", o.ior, 1.0, 3.0).within("roughness", o.roughness, 0.02, 1.0);
  check.within("depolarised", o.depolarised, 0.0, 1.0);
  check.within("intensity_error", o.intensity_error, 0.0, 0.3);
  check.at_least("paths", static_cast<double>(o.paths), 10'000.0);
  check.at_least("paths_per_pixel", static_cast<double>(o.paths_per_pixel), 16.0);
  check.above("period", o.period_mm, 0.0).above("blur", o.blur_mm, 0.0);
  if (o.beam) {
    check.above("beam.power", o.beam->power_w, 0.0);
    check.at_least("beam.paths", static_cast<double>(o.beam->paths), 1000.0);
  }
  for (const int dead : o.dead_lights)
    check.within("dead_lights", dead, 0, static_cast<double>(lights) - 1.0);
  return check.result();
}

std::vector<BallTruth> balls_of(const LedSphereOptions& options) {
  double width = options.gap_mm * static_cast<double>(options.radii_mm.size() - 1);
  for (const double radius : options.radii_mm) width += 2.0 * radius;
  std::vector<BallTruth> balls;
  double left = -0.5 * width;
  for (const double radius : options.radii_mm) {
    balls.push_back({{left + radius, 0.0, 0.0}, radius});
    left += 2.0 * radius + options.gap_mm;
  }
  return balls;
}

std::optional<SeenBall> see_ball(const std::vector<BallTruth>& balls,
                                 const CameraModel& camera,
                                 double x,
                                 double y) {
  return meet_ball(balls, camera.centre(), normalized(camera.ray_direction({x, y})));
}

std::optional<SeenBall> meet_ball(const std::vector<BallTruth>& balls, Vec3 eye, Vec3 way) {
  std::optional<SeenBall> seen;
  double nearest = 0.0;
  for (std::size_t b = 0; b < balls.size(); ++b) {
    const auto met = meet(eye, way, balls[b]);
    if (!met || (seen && nearest < *met)) continue;
    nearest = *met;
    const Vec3 point = eye + way * nearest;
    seen = SeenBall{b, point, normalized(point - balls[b].centre), way * -1.0};
  }
  return seen;
}

double diffusion_of(double reduced_albedo, double translucency_mm) {
  return decay(reduced_albedo) * translucency_mm / 3.0;
}

std::vector<SphereLight> true_lamps(const LedSphereOptions& options,
                                    std::vector<SphereLight> lamps) {
  for (std::size_t n = 0; n < lamps.size(); ++n) {
    const double z = normal_quantile(uniform(mix(mix(options.seed, 0x6c656473), n)));
    lamps[n].intensity *= std::max(0.0, 1.0 + options.intensity_error * z);
  }
  for (const int dead : options.dead_lights) lamps[static_cast<std::size_t>(dead)].intensity = 0.0;
  return lamps;
}

LedSphere::~LedSphere() = default;

LedSphere::LedSphere(const LedSphereOptions& options,
                     const std::vector<SphereLight>& lights,
                     const CameraOptics& camera)
    : options_(options),
      lights_(true_lamps(options, lights)),
      balls_(balls_of(options)),
      width_(camera.model.width),
      height_(camera.model.height),
      psf_sigma_px_(camera.psf_sigma_px) {
  look(camera);
}

void LedSphere::look(const CameraOptics& camera) {
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      if (const auto seen = see_ball(balls_, camera.model, x + 0.5, y + 0.5))
        seen_.push_back({*seen, static_cast<std::uint32_t>(y * width_ + x)});
}

Result<std::unique_ptr<const LedSphere>> LedSphere::create(const LedSphereOptions& options,
                                                           const std::vector<SphereLight>& lights,
                                                           const CameraOptics& camera,
                                                           EventSink& events,
                                                           std::stop_token stop) {
  if (auto good = validate(options, lights.size()); !good) return good.error().in("led sphere");
  std::unique_ptr<LedSphere> sphere(new LedSphere(options, lights, camera));
  double distance = 0.0;  // mean
  for (const SphereLight& light : lights)
    distance += length(light.position) / static_cast<double>(lights.size());
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  double done = 0.0;
  for (const BallTruth& ball : sphere->balls_) {
    Table table{std::vector<float>(3 * (kSteps + 1)), {}, {}};
    for (std::size_t c = 0; c < 3; ++c) {
      const double free_path = decay(options.reduced_albedo[c]) * options.translucency_mm[c];
      const Ball traced_ball{options.reduced_albedo[c], ball.radius_mm / free_path, options.ior};
      auto slanted = trace_ball(traced_ball, kTiltPaths, mix(options.seed, c), team);
      if (slanted && slanted->reflectance < 0.1)  // few paths come back, and they are short
        slanted = trace_ball(traced_ball, 8 * kTiltPaths, mix(options.seed, c), team);
      if (!slanted)
        return slanted.error().in(fmt::format(
            "ball of {} mm, translucency {} mm", ball.radius_mm, options.translucency_mm[c]));
      table.tilt[c] = slanted->tilt;
      auto traced = trace_response(traced_ball,
                                   distance / ball.radius_mm,
                                   {.paths = options.paths},
                                   mix(options.seed, c),
                                   team,
                                   stop);
      if (!traced)
        return traced.error().in(fmt::format(
            "ball of {} mm, translucency {} mm", ball.radius_mm, options.translucency_mm[c]));
      for (std::size_t n = 0; n <= kSteps; ++n)
        table.exitance[3 * n + c] =
            static_cast<float>(traced->exitance_at(2.0 * static_cast<double>(n) / kSteps - 1.0));
      table.responses[c] = *std::move(traced);
      done += 1.0;
      events.progress({"light in the balls",
                       done / (3.0 * static_cast<double>(sphere->balls_.size())),
                       std::nullopt,
                       nlohmann::json::object()});
    }
    sphere->tables_.push_back(std::move(table));
  }
  auto beam = BeamLight::trace(options, camera, events, stop);
  if (!beam) return beam.error().in("led sphere");
  sphere->beam_ = std::make_unique<const BeamLight>(*std::move(beam));
  return std::unique_ptr<const LedSphere>(std::move(sphere));
}

MirrorSurface LedSphere::surface_at(const Seen& seen) const {
  return {seen.point, seen.normal, seen.to_camera, options_.ior, options_.roughness};
}

/// `power` are I code/255.
Rgb LedSphere::diffuse(const Seen& seen, const std::vector<double>& power) const {
  const Table& table = tables_[seen.ball];
  const Vec3 centre = balls_[seen.ball].centre;
  std::array<float, 3> sum{};
  std::array<Vec3, 3> normals;
  for (std::size_t c = 0; c < 3; ++c)
    normals[c] = turned_away(seen.normal, seen.to_camera, table.tilt[c]);
  for (std::size_t n = 0; n < lights_.size(); ++n) {
    if (power[n] == 0.0) continue;
    const Vec3 to = lights_[n].position - centre;
    const double square = dot(to, to);
    const auto weight = static_cast<float>(power[n] / square);
    for (std::size_t c = 0; c < 3; ++c) {
      const double cosine = dot(to, normals[c]) / std::sqrt(square);
      const double place = (cosine + 1.0) * (0.5 * kSteps);
      const auto at = std::min(static_cast<std::size_t>(std::max(0.0, place)), kSteps - 1);
      const auto part = static_cast<float>(place - static_cast<double>(at));
      const float* entry = &table.exitance[3 * at + c];
      sum[c] += weight * (entry[0] + part * (entry[3] - entry[0]));
    }
  }
  Rgb radiance{};
  const double cosine = dot(seen.normal, seen.to_camera);
  for (std::size_t c = 0; c < 3; ++c)
    radiance[c] = options_.depolarised / pi * table.responses[c].law_at(cosine) * sum[c];
  return radiance;
}

StationLight LedSphere::light(const Image<std::uint8_t>& codes) const {
  StationLight light = dark();
  std::vector<double> power(lights_.size(), 0.0);
  for (std::size_t n = 0; n < lights_.size(); ++n) {
    power[n] = lights_[n].intensity * codes.at(static_cast<int>(n), 0) / 255.0;
    const double irradiance = power[n] / dot(lights_[n].position, lights_[n].position);
    light.patch_irradiance[n] = {irradiance, irradiance, irradiance};
  }
  const bool parallel = codes.at(static_cast<int>(lights_.size()), 0) != 0;
  for (const Seen& seen : seen_) {
    const Rgb radiance = diffuse(seen, power);
    const double mirrored = parallel ? mirrored_lamps(lights_, power, surface_at(seen)) : 0.0;
    float* const pixel = &light.surface_radiance.samples()[3 * std::size_t{seen.pixel}];
    for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<float>(radiance[c] + mirrored);
  }
  if (options_.beam)
    beam_->add(codes.at(static_cast<int>(lights_.size()) - 1, 0) / 255.0, light.surface_radiance);
  light.sensor_radiance = blurred(light.surface_radiance, psf_sigma_px_);
  return light;
}

StationLight LedSphere::dark() const {
  return {std::vector<Rgb>(lights_.size(), Rgb{}), Image<float>(width_, height_, 3), {}};
}

std::string LedSphere::scene() const {
  auto balls = nlohmann::ordered_json::array();
  for (const BallTruth& ball : balls_)
    balls.push_back({{"centre_mm", {ball.centre.x, ball.centre.y, ball.centre.z}},
                     {"radius_mm", ball.radius_mm}});
  Rgb diffusion{};
  for (std::size_t c = 0; c < 3; ++c)
    diffusion[c] = diffusion_of(options_.reduced_albedo[c], options_.translucency_mm[c]);
  return nlohmann::ordered_json{{"kind", "led_sphere"},
                                {"balls", balls},
                                {"reduced_albedo", options_.reduced_albedo},
                                {"translucency_mm", options_.translucency_mm},
                                {"diffusion_mm", diffusion},
                                {"ior", options_.ior}}
      .dump();
}

}  // namespace opaline::sim
