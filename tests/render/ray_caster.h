#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/camera_model.h"
#include "render/surface_field.h"

namespace opaline::tests {

/// The picture that render::Renderer should draw, by another way: one ray a sample from
/// base/camera_model.h, met with the box by slabs, plain loops in float64.
class RayCaster {
 public:
  RayCaster(const render::SurfaceField& field, const CameraModel& camera)
      : field_(field), camera_(camera), centre_(camera.centre()) {}

  Image<float> draw(int samples_per_axis) const {
    Image<float> picture(camera_.width, camera_.height, 4);
    for (int y = 0; y < camera_.height; ++y)
      for (int x = 0; x < camera_.width; ++x) draw_pixel(picture, x, y, samples_per_axis);
    return picture;
  }

 private:
  struct Hit {
    Face face;
    Vec3 point;
    double cosine;
  };

  void draw_pixel(Image<float>& picture, int x, int y, int s) const {
    std::array<double, 4> sum{};
    for (int k = 0; k < s * s; ++k) {
      const int row = k / s;
      const Vec3 ray = camera_.ray_direction({x + (k % s + 0.5) / s, y + (row + 0.5) / s});
      const std::optional<Hit> hit = meet(ray);
      if (!hit) continue;
      for (int c = 0; c < 3; ++c) sum[c] += radiance(*hit, c);
      sum[3] += 1.0;
    }
    for (int c = 0; c < 4; ++c) picture.at(x, y, c) = static_cast<float>(sum[c] / (s * s));
  }

  std::optional<Hit> meet(Vec3 ray) const {
    const std::array<double, 3> o{centre_.x, centre_.y, centre_.z};
    const std::array<double, 3> d{ray.x, ray.y, ray.z};
    const Vec3 size = field_.block.size();
    const std::array<double, 3> end{size.x, size.y, size.z};
    double enter = 0.0;
    double leave = HUGE_VAL;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      if (d[a] == 0.0 && (o[a] < 0.0 || o[a] > end[a])) return {};
      if (d[a] == 0.0) continue;
      const double first = ((d[a] > 0.0 ? 0.0 : end[a]) - o[a]) / d[a];
      leave = std::min(leave, ((d[a] > 0.0 ? end[a] : 0.0) - o[a]) / d[a]);
      if (first > enter) enter = first, axis = a;
    }
    if (axis < 0 || enter > leave) return {};
    const auto face = static_cast<Face>(2 * axis + (d[axis] < 0.0 ? 1 : 0));
    return Hit{face, centre_ + ray * enter, std::abs(d[axis])};
  }

  double radiance(const Hit& hit, int channel) const {
    const double eta = field_.ior;
    const double mu_o = hit.cosine;
    const double mu_i = std::sqrt(1.0 - (1.0 - mu_o * mu_o) / (eta * eta));
    const double ts =
        2.0 * mu_o / (mu_o + eta * mu_i);  // amplitudes of Fresnel's transmitted waves
    const double tp = 2.0 * mu_o / (eta * mu_o + mu_i);
    const double transmitted = 0.5 * eta * mu_i / mu_o * (ts * ts + tp * tp);
    const render::FaceField& f = field_.faces[static_cast<std::size_t>(hit.face)];
    const double inside =
        interpolate(f.fluence, hit, channel) + 3.0 * mu_i * interpolate(f.net_flux, hit, channel);
    return transmitted / (4.0 * std::numbers::pi * eta * eta) * inside;
  }

  double interpolate(const Image<float>& raster, const Hit& hit, int channel) const {
    const Block& b = field_.block;
    const std::array<double, 3> in_cells{
        hit.point.x / b.hx, hit.point.y / b.hy, hit.point.z / b.hz};
    const int axis = axis_of(hit.face);
    const double u = std::clamp(in_cells[axis == 0 ? 1 : 0] - 0.5, 0.0, raster.width() - 1.0);
    const double v = std::clamp(in_cells[axis == 2 ? 1 : 2] - 0.5, 0.0, raster.height() - 1.0);
    const int x0 = std::min(static_cast<int>(u), std::max(raster.width() - 2, 0));
    const int y0 = std::min(static_cast<int>(v), std::max(raster.height() - 2, 0));
    const int x1 = std::min(x0 + 1, raster.width() - 1);
    const int y1 = std::min(y0 + 1, raster.height() - 1);
    const double tx = u - x0;
    const double ty = v - y0;
    return (1 - ty) * ((1 - tx) * raster.at(x0, y0, channel) + tx * raster.at(x1, y0, channel)) +
           ty * ((1 - tx) * raster.at(x0, y1, channel) + tx * raster.at(x1, y1, channel));
  }

  const render::SurfaceField& field_;
  const CameraModel& camera_;
  Vec3 centre_;
};

}  // namespace opaline::tests
