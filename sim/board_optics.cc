#include "sim/board_optics.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace opaline::sim {
namespace {

constexpr int kAcross = 2;  // places of a pixel, each way
constexpr std::size_t kPlaces = std::size_t{kAcross} * kAcross;

// The ray of z = 1 through a pixel, by iteration against the distortion.
std::array<double, 2> ray_of(const CameraModel& lens, double x, double y) {
  CameraModel at_rest = lens;
  at_rest.camera_from_sample = {};
  const Vec3 d = at_rest.ray_direction({x, y});
  return {d.x / d.z, d.y / d.z};
}

// Between the centres of four pixels; dark outside the picture.
float between(const Image<float>& picture, float x, float y, int channel) {
  const float u = x - 0.5f;
  const float v = y - 0.5f;
  const int i = std::clamp(static_cast<int>(std::floor(u)), 0, picture.width() - 2);
  const int j = std::clamp(static_cast<int>(std::floor(v)), 0, picture.height() - 2);
  const float s = std::clamp(u - static_cast<float>(i), 0.0f, 1.0f);
  const float t = std::clamp(v - static_cast<float>(j), 0.0f, 1.0f);
  return (1 - t) * ((1 - s) * picture.at(i, j, channel) + s * picture.at(i + 1, j, channel)) +
         t * ((1 - s) * picture.at(i, j + 1, channel) + s * picture.at(i + 1, j + 1, channel));
}

bool is_grey(const Image<std::uint8_t>& codes) {
  const auto s = codes.samples();
  for (std::size_t i = 0; i + 2 < s.size(); i += 3) {
    if (s[i] != s[i + 1] || s[i] != s[i + 2]) return false;
  }
  return true;
}

}  // namespace

BoardOptics::BoardOptics(const CameraOptics& camera,
                         const ProjectorOptics& projector,
                         const BoardSceneOptions& scene)
    : camera_(camera),
      projector_(projector),
      scene_(scene),
      projector_vignetting_(
          vignetting_map(projector.width, projector.height, projector.vignetting)) {
  rays_.reserve(2 * kPlaces * camera.model.width * camera.model.height);
  for (int y = 0; y < camera.model.height; ++y) {
    for (int x = 0; x < camera.model.width; ++x) {
      for (std::size_t k = 0; k < kPlaces; ++k) {
        const std::size_t down = k / kAcross;
        const auto ray = ray_of(camera.model,
                                x + (static_cast<double>(k % kAcross) + 0.5) / kAcross,
                                y + (static_cast<double>(down) + 0.5) / kAcross);
        rays_.push_back(static_cast<float>(ray[0]));
        rays_.push_back(static_cast<float>(ray[1]));
      }
    }
  }
}

SimBoardPose BoardOptics::held(std::uint64_t state) const {
  SimBoardPose pose = scene_.poses[(state / kNextPose) % scene_.poses.size()];
  const double nudged = scene_.nudge_mm * static_cast<double>(state % kNextPose);
  pose.sample_from_board.translation.x += nudged;
  pose.sample_from_board.translation.z += nudged;
  return pose;
}

BoardOptics::Look BoardOptics::look(const SimBoardPose& pose) const {
  const SimBoard& board = scene_.board;
  const Pose board_from_camera = [&] {
    const Pose board_from_sample = pose.sample_from_board.inverse();
    const Pose sample_from_camera = camera_.model.camera_from_sample.inverse();
    Pose out;
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        out.rotation[3 * r + c] = 0.0;
        for (std::size_t k = 0; k < 3; ++k)
          out.rotation[3 * r + c] +=
              board_from_sample.rotation[3 * r + k] * sample_from_camera.rotation[3 * k + c];
      }
    }
    out.translation = board_from_sample.apply(sample_from_camera.translation);
    return out;
  }();
  const Vec3 eye = board_from_camera.translation;
  const Vec3 camera_eye = camera_.model.centre();
  const Vec3 lamp = pose.sample_from_board.inverse().apply(scene_.projector.centre());
  const double hidden_from = (1.0 - pose.hidden) * board.width_mm();
  const double pixel = 1.0 / camera_.model.fx / kAcross;
  Look look;
  look.places.resize(rays_.size() / 2);
  for (std::size_t i = 0; i < look.places.size(); ++i) {
    const Vec3 d = board_from_camera.rotate({rays_[2 * i], rays_[2 * i + 1], 1.0});
    const double t = -eye.z / d.z;
    if (!(t > 0.0)) continue;
    if (scene_.sample && scene_.sample->holds(camera_eye, pose.sample_from_board.rotate(d)))
      continue;
    const double x = eye.x + t * d.x;
    const double y = eye.y + t * d.y;
    const double a = board.albedo(x, y, t * pixel);
    if (a <= 0.0 || (pose.hidden > 0.0 && x > hidden_from)) continue;
    const Vec3 there = pose.sample_from_board.apply({x, y, 0.0});
    if (!scene_.projector.faces(there)) continue;
    const auto p = scene_.projector.project(there);
    if (p.x < 0.0 || p.y < 0.0 || p.x > projector_.width || p.y > projector_.height) continue;
    const Vec3 to_lamp = lamp - Vec3{x, y, 0.0};
    const double distance = length(to_lamp);
    const double falls = scene_.reference_distance_mm / distance;
    const double cosine = -to_lamp.z / distance;  // the board's front is at negative z
    if (cosine <= 0.0) continue;
    look.places[i] = {static_cast<float>(a / std::numbers::pi * falls * falls * cosine),
                      static_cast<float>(p.x),
                      static_cast<float>(p.y)};
  }
  const double away = camera_.model.camera_from_sample
                          .apply(pose.sample_from_board.apply(
                              {0.5 * board.width_mm(), 0.5 * board.height_mm(), 0.0}))
                          .z;
  look.blur_px = std::hypot(
      camera_.psf_sigma_px, scene_.focus_px * (1.0 - scene_.focus_mm / away), pose.defocus_px);
  return look;
}

Image<float> BoardOptics::projected(const Image<std::uint8_t>& codes) const {
  const int channels = is_grey(codes) ? 1 : 3;
  Image<float> picture(codes.width(), codes.height(), channels);
  const std::array<float, 256> light = light_of_codes(projector_);
  for (std::size_t i = 0; i < picture.pixel_count(); ++i) {
    for (int c = 0; c < channels; ++c) {
      picture.samples()[i * channels + c] =
          light[codes.samples()[3 * i + c]] * projector_vignetting_.samples()[i];
    }
  }
  return blurred(picture, scene_.projector_blur_px);
}

StationLight BoardOptics::lit(const Look& look, const Image<std::uint8_t>& codes) const {
  const Image<float> shown = projected(codes);
  const int channels = shown.channels();
  Image<float> seen(camera_.model.width, camera_.model.height, channels);
  for (std::size_t i = 0; i < look.places.size(); ++i) {
    const Place& place = look.places[i];
    if (place.albedo <= 0.0f) continue;
    for (int c = 0; c < channels; ++c) {
      seen.samples()[i / kPlaces * channels + c] +=
          place.albedo / kPlaces * between(shown, place.x, place.y, c);
    }
  }
  const Image<float> soft = blurred(seen, look.blur_px);
  StationLight light = dark();
  light.sensor_radiance = Image<float>(soft.width(), soft.height(), 3);
  for (std::size_t i = 0; i < light.sensor_radiance.samples().size(); ++i) {
    const std::size_t from = channels == 1 ? i / 3 : i;
    light.sensor_radiance.samples()[i] =
        static_cast<float>(projector_.peak_irradiance[i % 3]) * soft.samples()[from];
  }
  return light;
}

StationLight BoardOptics::light_of(const SimBoardPose& pose,
                                   const Image<std::uint8_t>& codes) const {
  return lit(look(pose), codes);
}

StationLight BoardOptics::light(const Image<std::uint8_t>& codes) const {
  const std::uint64_t state = state_.load();
  std::shared_ptr<const Look> now;
  {
    const std::lock_guard lock(mutex_);
    if (looked_at_ != state) {
      look_ = std::make_shared<const Look>(look(held(state)));
      looked_at_ = state;
    }
    now = look_;
  }
  return lit(*now, codes);
}

StationLight BoardOptics::dark() const { return {{Rgb{}}, Image<float>(1, 1, 3), {}}; }

std::string BoardOptics::scene() const {
  const SimBoardPose pose = held();
  const Vec3 t = pose.sample_from_board.translation;
  return nlohmann::json{
      {"kind", "board"},
      {"square_mm", scene_.board.square_mm},
      {"pose", state_.load() / kNextPose % scene_.poses.size()},
      {"sample_from_board",
       {{"rotation", pose.sample_from_board.rotation}, {"translation_mm", {t.x, t.y, t.z}}}}}
      .dump();
}

}  // namespace opaline::sim
