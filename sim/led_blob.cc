#include "sim/led_blob.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>
#include <utility>

#include "sim/hash.h"
#include "sim/led_beam.h"

namespace opaline::sim {
namespace {

constexpr int kSmoothPixels = 7;

BlobCoefficients coefficients(double reduced_albedo, double translucency_mm) {
  return {1.0 / (3.0 * diffusion_of(reduced_albedo, translucency_mm)), reduced_albedo};
}

double mean_distance(const std::vector<SphereLight>& lights) {
  double sum = 0.0;
  for (const SphereLight& light : lights)
    sum += length(light.position) / static_cast<double>(lights.size());
  return sum;
}

double noise_of(const std::vector<BlobTransfer>& transfer) {
  double sum = 0.0;
  for (const BlobTransfer& t : transfer)
    if (t.terms[0] > 0.0F) sum += std::sqrt(std::max(0.0F, t.variance)) / t.terms[0];
  return sum / std::max<double>(1.0, static_cast<double>(transfer.size()));
}

}  // namespace

LedTruth::LedTruth(LedSphereOptions options)
    : options_(std::move(options)), balls_(balls_of(options_)) {}

Result<LedTruth> LedTruth::create(const LedSphereOptions& options) {
  LedTruth truth(options);
  if (options.body.empty()) return truth;
  if (options.radii_mm.size() != 1)
    return invalid_argument(fmt::format(
        "{} radii; expected one, of the body {}", options.radii_mm.size(), options.body));
  const auto shape = blob_of_name(options.body, options.radii_mm[0]);
  if (!shape) return shape.error();
  truth.blob_.emplace(*shape);
  return truth;
}

BlobMaterial LedTruth::material(std::size_t c) const {
  const LedSphereOptions& o = options_;
  return {coefficients(o.reduced_albedo[c], o.translucency_mm[c]),
          coefficients(o.second_reduced_albedo[c], o.second_translucency_mm[c]),
          o.body.empty() ? BlobMixture::kNone : o.mixture,
          o.period_mm,
          o.blur_mm,
          o.ior};
}

std::optional<ObjectTruth> LedTruth::at(const CameraModel& camera, double x, double y) const {
  return along(camera.centre(), normalized(camera.ray_direction({x, y})));
}

std::optional<ObjectTruth> LedTruth::along(Vec3 eye, Vec3 way) const {
  ObjectTruth truth;
  if (blob_) {
    const auto met = blob_->meets(eye, way);
    if (!met) return std::nullopt;
    truth.point = eye + way * *met;
    truth.normal = blob_->normal(truth.point);
    truth.curvature = blob_->mean_curvature(truth.point);
  } else {
    const auto seen = meet_ball(balls_, eye, way);
    if (!seen) return std::nullopt;
    truth.object = seen->ball;
    truth.point = seen->point;
    truth.normal = seen->normal;
    truth.curvature = 1.0 / balls_[seen->ball].radius_mm;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const BlobMaterial material = this->material(c);
    const BlobCoefficients here = material.at(truth.point);
    truth.second = material.share(truth.point);
    truth.reduced_albedo[c] = static_cast<float>(here.reduced_albedo);
    truth.diffusion_mm[c] = static_cast<float>(1.0 / (3.0 * here.extinction));
  }
  return truth;
}

LedBlob::~LedBlob() = default;

LedBlob::LedBlob(LedTruth truth, const std::vector<SphereLight>& lights, const CameraOptics& camera)
    : truth_(std::move(truth)),
      lights_(true_lamps(truth_.options(), lights)),
      width_(camera.model.width),
      height_(camera.model.height),
      psf_sigma_px_(camera.psf_sigma_px),
      pixel_mm_(length(camera.model.centre()) / camera.model.fx) {
  look(camera);
}

void LedBlob::look(const CameraOptics& camera) {
  const Vec3 eye = camera.model.centre();
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const auto seen = truth_.at(camera.model, x + 0.5, y + 0.5);
      if (!seen) continue;
      places_.push_back({seen->point, seen->normal, normalized(eye - seen->point)});
      pixels_.push_back(static_cast<std::uint32_t>(y * width_ + x));
    }
}

Result<void> LedBlob::trace(EventSink& events, std::stop_token stop) {
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  const LedSphereOptions& o = truth_.options();
  const TransferSize size{o.paths_per_pixel, mean_distance(lights_)};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto same = [&](std::size_t other) {
      return o.reduced_albedo[c] == o.reduced_albedo[other] &&
             o.translucency_mm[c] == o.translucency_mm[other] &&
             o.second_reduced_albedo[c] == o.second_reduced_albedo[other] &&
             o.second_translucency_mm[c] == o.second_translucency_mm[other];
    };
    if (c > 0 && same(c - 1)) {
      transfer_[c] = transfer_[c - 1];
      continue;
    }
    const auto tell = [&](double share) {
      events.progress({"light in the body",
                       (static_cast<double>(c) + share) / 3.0,
                       std::nullopt,
                       nlohmann::json::object()});
    };
    const auto traced = trace_transfer(
        *truth_.blob(), truth_.material(c), places_, size, mix(o.seed, c), team, tell, stop);
    if (!traced) return traced.error();
    transfer_[c] =
        smoothed(*traced, places_, pixels_, width_, kSmoothPixels, kSmoothPixels * pixel_mm_, team);
    if (c == 0) path_noise_ = noise_of(transfer_[0]);
  }
  return ok();
}

Result<std::unique_ptr<const LightPath>> LedBlob::create(const LedSphereOptions& options,
                                                         const std::vector<SphereLight>& lights,
                                                         const CameraOptics& camera,
                                                         EventSink& events,
                                                         std::stop_token stop) {
  if (auto good = validate(options, lights.size()); !good) return good.error().in("led sphere");
  auto truth = LedTruth::create(options);
  if (!truth) return truth.error().in("led sphere");
  if (!truth->blob()) return invalid_argument("led sphere: no body is named");
  std::unique_ptr<LedBlob> made(new LedBlob(*std::move(truth), lights, camera));
  if (auto traced = made->trace(events, stop); !traced) return traced.error();
  auto beam = BeamLight::trace(options, camera, events, std::move(stop));
  if (!beam) return beam.error().in("led sphere");
  made->beam_ = std::make_unique<const BeamLight>(*std::move(beam));
  return std::unique_ptr<const LightPath>(std::move(made));
}

StationLight LedBlob::light(const Image<std::uint8_t>& codes) const {
  StationLight light = dark();
  std::vector<double> power(lights_.size(), 0.0);
  std::array<double, kTransferTerms> field{};
  for (std::size_t n = 0; n < lights_.size(); ++n) {
    power[n] = lights_[n].intensity * codes.at(static_cast<int>(n), 0) / 255.0;
    const double square = dot(lights_[n].position, lights_[n].position);
    const auto irradiance = static_cast<float>(power[n] / square);
    light.patch_irradiance[n] = {irradiance, irradiance, irradiance};
    const auto y = harmonics(lights_[n].position * (1.0 / std::sqrt(square)));
    for (std::size_t k = 0; k < kTransferTerms; ++k) field[k] += power[n] / square * y[k];
  }
  const bool parallel = codes.at(static_cast<int>(lights_.size()), 0) != 0;
  const LedSphereOptions& o = truth_.options();
  for (std::size_t n = 0; n < places_.size(); ++n) {
    const SeenPlace& seen = places_[n];
    const double mirrored =
        parallel
            ? mirrored_lamps(
                  lights_, power, {seen.point, seen.normal, seen.to_camera, o.ior, o.roughness})
            : 0.0;
    float* const pixel = &light.surface_radiance.samples()[3 * std::size_t{pixels_[n]}];
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0.0;
      for (std::size_t k = 0; k < kTransferTerms; ++k) sum += field[k] * transfer_[c][n].terms[k];
      pixel[c] = static_cast<float>(o.depolarised * std::max(0.0, sum) + mirrored);
    }
  }
  if (o.beam)
    beam_->add(codes.at(static_cast<int>(lights_.size()) - 1, 0) / 255.0, light.surface_radiance);
  light.sensor_radiance = blurred(light.surface_radiance, psf_sigma_px_);
  return light;
}

StationLight LedBlob::dark() const {
  return {std::vector<Rgb>(lights_.size(), Rgb{}), Image<float>(width_, height_, 3), {}};
}

std::string LedBlob::scene() const {
  const LedSphereOptions& o = truth_.options();
  static constexpr std::array kMixtures{"none", "halves", "bands"};
  return nlohmann::ordered_json{{"kind", "led_blob"},
                                {"body", o.body},
                                {"radius_mm", o.radii_mm[0]},
                                {"reduced_albedo", o.reduced_albedo},
                                {"translucency_mm", o.translucency_mm},
                                {"mixture", kMixtures[static_cast<std::size_t>(o.mixture)]},
                                {"second_reduced_albedo", o.second_reduced_albedo},
                                {"second_translucency_mm", o.second_translucency_mm},
                                {"ior", o.ior}}
      .dump();
}

Result<std::unique_ptr<const LightPath>> make_led_object(const LedSphereOptions& options,
                                                         const std::vector<SphereLight>& lights,
                                                         const CameraOptics& camera,
                                                         EventSink& events,
                                                         std::stop_token stop) {
  if (!options.body.empty())
    return LedBlob::create(options, lights, camera, events, std::move(stop));
  auto balls = LedSphere::create(options, lights, camera, events, std::move(stop));
  if (!balls) return balls.error();
  return std::unique_ptr<const LightPath>(*std::move(balls));
}

}  // namespace opaline::sim
