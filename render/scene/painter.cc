#include "render/scene/painter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"
#include "render/scene/specular.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::fresnel_reflectance;
using reconstruct::diffusion::refracted_cosine;

constexpr double kGrazing =
    0.02;  // cosine below which an interpolated normal looks away from the camera

bool is_marked(const Look& look, const Surfaces::Hit& hit) {
  double mark = 0.0;
  for (int k = 0; k < 3 && !look.marks.empty(); ++k) {
    mark += hit.weights[k] * look.marks[hit.vertices[k]];
  }
  return mark > 0.5;
}

/// The normal bent towards the viewer where interpolation has turned it away.
Vec3 facing(Vec3 normal, Vec3 view) {
  const double cosine = dot(normal, view);
  if (cosine >= kGrazing) return normal;
  return normalized(normal + view * (kGrazing - cosine));
}

/// What Lambert's reflectance is there.
Colour matte_of(const Look& look, const Surfaces::Hit& hit) {
  if (!look.translucent) return look.reflectance;
  Colour matte{};
  for (int k = 0; k < 3 && !look.finish.empty(); ++k) {
    const Colour& corner = look.finish[hit.vertices[k]];
    for (int c = 0; c < 3; ++c) matte[c] += hit.weights[k] * corner[c];
  }
  return matte;
}

bool differs(const Painter::Seen& a, const Painter::Seen& b) {
  if (a.object != b.object) return true;
  for (int c = 0; c < 3; ++c) {
    const double larger = std::max(a.radiance[c], b.radiance[c]);
    if (std::abs(a.radiance[c] - b.radiance[c]) > Painter::kContrast * larger) return true;
  }
  return false;
}

/// Rows handed out to a team.
template <class Work>
void for_rows(int rows, ThreadTeam& team, const std::stop_token& stop, const Work& work) {
  std::atomic<int> next{0};
  team.run([&](int) {
    for (int y = next++; y < rows && !stop.stop_requested(); y = next++) work(y);
  });
}

}  // namespace

Colour Painter::emerging(const Look& look, const Surfaces::Hit& hit, Vec3 view) const {
  const double cosine = dot(hit.normal, view);
  const double scale = (1.0 - fresnel_reflectance(cosine, look.ior)) /
                       (4.0 * std::numbers::pi * look.ior * look.ior);
  const double inside = refracted_cosine(cosine, look.ior);
  Colour radiance{};
  if (look.once != nullptr) {
    radiance = look.once->seen(hit.triangle, hit.place, refracted(view, hit.normal, look.ior));
  }
  for (int c = 0; c < 3; ++c) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
      const int v = hit.vertices[k];
      sum += hit.weights[k] * (look.light.fluence[v][c] + 3.0 * inside * look.light.net_flux[v][c]);
    }
    radiance[c] = scale * (radiance[c] + std::max(0.0, sum));
  }
  return radiance;
}

Colour Painter::scattered(const Look& look, const Surfaces::Hit& hit, const Colour& matte) const {
  if (is_black(environment_.radiance)) return {};
  double sky = 0.0;
  for (int k = 0; k < 3; ++k) sky += hit.weights[k] * look.sky[hit.vertices[k]];
  Colour radiance{};
  for (int c = 0; c < 3; ++c) radiance[c] = matte[c] * sky * environment_.radiance[c];
  return radiance;
}

void Painter::add_mirrored(const Look& look,
                           const Surfaces::Hit& hit,
                           const Colour& matte,
                           Vec3 view,
                           Colour& radiance) const {
  for (const LightOptions& light : lights_) {
    const LightSample from = sample(light, hit.place);
    const double cosine = dot(hit.normal, from.towards);
    if (!(cosine > 0.0) || is_black(from.irradiance)) continue;
    const double mirrored = specular_brdf(look.surface, look.ior, hit.normal, from.towards, view);
    if (is_black(matte) && mirrored == 0.0) continue;
    if (light.shadows && surfaces_.hides(hit.start, from.towards, from.distance)) continue;
    for (int c = 0; c < 3; ++c) {
      radiance[c] += (matte[c] / std::numbers::pi + mirrored) * cosine * from.irradiance[c];
    }
  }
  if (is_black(environment_.radiance) || look.ior == 1.0 ||
      look.surface.specular == SpecularModel::kNone) {
    return;
  }
  const double cosine = std::min(1.0, dot(hit.normal, view));
  const Vec3 mirrored = hit.normal * (2.0 * cosine) - view;
  if (surfaces_.hides(hit.start, mirrored, std::numeric_limits<double>::infinity())) return;
  const double share = fresnel_reflectance(cosine, look.ior);
  for (int c = 0; c < 3; ++c) radiance[c] += share * environment_.radiance[c];
}

Painter::Seen Painter::look(const Ray& ray) const {
  auto hit = surfaces_.nearest(ray);
  if (!hit) return {};
  const Vec3 view = ray.direction * -1.0;
  const Look& look = looks_[hit->object];
  if (!look.translucent && dot(hit->facet, view) < 0.0) hit->normal = hit->normal * -1.0;
  hit->normal = facing(hit->normal, view);
  hit->start.normal = hit->normal;
  Seen seen{.radiance = {}, .object = hit->object};
  if (is_marked(look, *hit)) {
    return {.radiance = {look.mark_radiance, 0.0, look.mark_radiance}, .object = hit->object};
  }
  const Colour matte = matte_of(look, *hit);
  if (!is_black(matte)) seen.radiance = scattered(look, *hit, matte);
  if (look.translucent) {
    const Colour inner = emerging(look, *hit, view);
    for (int c = 0; c < 3; ++c) seen.radiance[c] += inner[c];
  }
  add_mirrored(look, *hit, matte, view, seen.radiance);
  return seen;
}

Result<Image<float>> Painter::draw(const CameraModel& camera,
                                   int samples_per_axis,
                                   ThreadTeam& team,
                                   std::stop_token stop) const {
  const Vec3 centre = camera.centre();
  const auto ray_through = [&](double x, double y) {
    return Ray{centre, normalized(camera.ray_direction({x, y}))};
  };
  const int width = camera.width;
  const int height = camera.height;
  std::vector<Seen> first(static_cast<std::size_t>(width) * height);
  const auto at = [&](int x, int y) -> Seen& {
    return first[static_cast<std::size_t>(y) * width + x];
  };
  for_rows(height, team, stop, [&](int y) {
    for (int x = 0; x < width; ++x) at(x, y) = look(ray_through(x + 0.5, y + 0.5));
  });
  const auto at_edge = [&](int x, int y) {
    for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
      for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i) {
        if (differs(at(i, j), at(x, y))) return true;
      }
    }
    return false;
  };
  Image<float> picture(width, height, 4);
  for_rows(height, team, stop, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const int n = samples_per_axis > 1 && at_edge(x, y) ? samples_per_axis : 1;
      std::array<double, 4> sum{};
      for (int k = 0; k < n * n; ++k) {
        const int row = k / n;
        const Seen seen =
            n == 1 ? at(x, y) : look(ray_through(x + (k % n + 0.5) / n, y + (row + 0.5) / n));
        for (int c = 0; c < 3; ++c) sum[c] += seen.radiance[c];
        sum[3] += seen.object >= 0 ? 1.0 : 0.0;
      }
      for (int c = 0; c < 4; ++c) picture.at(x, y, c) = static_cast<float>(sum[c] / (n * n));
    }
  });
  if (stop.stop_requested()) return cancelled("drawing the picture");
  return picture;
}

}  // namespace opaline::render
