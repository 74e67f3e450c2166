#include "render/raster/raster_buffers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/scene/surfaces.h"

namespace opaline::render {
namespace {

constexpr double kMargin = 1.01;   // around the scene in a shadow map
constexpr double kWidest = 80.0;   // degrees from a shadow map's middle to its side
constexpr double kNearest = 1e-3;  // of the scene's radius, in front of a light
constexpr double kRadians = std::numbers::pi / 180.0;

Vec4f vec4(Vec3 v, double w) {
  return {static_cast<float>(v.x),
          static_cast<float>(v.y),
          static_cast<float>(v.z),
          static_cast<float>(w)};
}

Vec4f vec4(const Colour& c, double w) { return vec4(Vec3{c[0], c[1], c[2]}, w); }

/// The row that gives scale (axis . (p - from)) + offset.
Vec4f row(Vec3 axis, Vec3 from, double scale, double offset) {
  return vec4(axis * scale, offset - scale * dot(axis, from));
}

struct ShadowView {
  Rows rows{};
  double texel = 0.0;  // its side at distance 1, or anywhere of a directional light
};

ShadowView directional_view(Vec3 along, const RasterGeometry& scene, int texels) {
  const Frame frame = frame_around(along);
  const double radius = kMargin * scene.casters.radius;
  ShadowView view;
  view.rows = {row(frame.x, scene.casters.centre, 1.0 / radius, 0.0),
               row(frame.y, scene.casters.centre, 1.0 / radius, 0.0),
               row(frame.z, scene.all.centre, -0.5 / (kMargin * scene.all.radius), 0.5),
               Vec4f{0.0F, 0.0F, 0.0F, 1.0F}};
  view.texel = 2.0 * radius / texels;
  return view;
}

ShadowView perspective_view(
    Vec3 position, Vec3 along, double half_angle, double near_mm, int texels) {
  const Frame frame = frame_around(along);
  const double wide = std::tan(half_angle);
  ShadowView view;
  view.rows = {row(frame.x, position, 1.0 / wide, 0.0),
               row(frame.y, position, 1.0 / wide, 0.0),
               Vec4f{0.0F, 0.0F, 0.0F, static_cast<float>(near_mm)},
               row(frame.z, position, 1.0, 0.0)};
  view.texel = 2.0 * wide / texels;
  return view;
}

/// None where a light that is not far away does not see the scene within one map.
std::optional<ShadowView> shadow_view(const LightOptions& light,
                                      const RasterGeometry& scene,
                                      int texels) {
  if (light.kind == LightOptions::Kind::kDirectional) {
    return directional_view(normalized(light.direction), scene, texels);
  }
  const Vec3 way = scene.casters.centre - light.position;
  const double distance = length(way);
  const double radius = kMargin * scene.casters.radius;
  const double to_all = length(scene.all.centre - light.position);
  const double near_mm = std::max(to_all - kMargin * scene.all.radius, kNearest * scene.all.radius);
  const double ball = distance > radius ? std::asin(radius / distance) : std::numbers::pi;
  const double cone = light.cone_degrees * kRadians;
  if (light.kind == LightOptions::Kind::kSpot && cone < std::min(ball, kWidest * kRadians)) {
    return perspective_view(
        light.position, normalized(light.direction), kMargin * cone, near_mm, texels);
  }
  if (ball > kWidest * kRadians) return std::nullopt;
  return perspective_view(light.position, normalized(way), kMargin * ball, near_mm, texels);
}

Colour strength_of(const LightOptions& light) {
  if (light.kind == LightOptions::Kind::kDirectional) return light.irradiance;
  if (light.kind != LightOptions::Kind::kDisc) return light.intensity;
  Colour intensity = light.radiance;
  for (double& value : intensity) value *= std::numbers::pi * light.radius_mm * light.radius_mm;
  return intensity;
}

bool is_closed(const SceneRenderer::DrawnObject& object) {
  return object.look->translucent && object.look->marks.empty();
}

/// One object's vertices and triangles.
class RasterMesh {
 public:
  RasterMesh(const SceneRenderer::DrawnObject& object, int number, RasterGeometry& geometry)
      : mesh_(object.surface->mesh()),
        normals_(object.surface->normals()),
        look_(*object.look),
        number_(number),
        geometry_(geometry) {}

  void add() {
    const auto first = static_cast<std::uint32_t>(geometry_.vertices.size());
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      add_vertex(static_cast<int>(v), normals_[v]);
    }
    for (const auto& t : mesh_.triangles) {
      const Vec3 a = mesh_.vertices[t[0]];
      const Vec3 facet = normalized(cross(mesh_.vertices[t[1]] - a, mesh_.vertices[t[2]] - a));
      const bool creased = std::ranges::any_of(
          t, [&](int v) { return !(dot(normals_[v], facet) > Surfaces::kCrease); });
      for (const int v : t) {
        geometry_.corners.push_back(creased ? add_vertex(v, facet)
                                            : first + static_cast<std::uint32_t>(v));
      }
    }
  }

 private:
  std::uint32_t add_vertex(int v, Vec3 normal) {
    const auto added = static_cast<std::uint32_t>(geometry_.vertices.size());
    geometry_.vertices.push_back({vec4(mesh_.vertices[v], number_),
                                  vec4(normal, look_.sky.empty() ? 1.0 : look_.sky[v]),
                                  vec4(!look_.translucent     ? look_.reflectance
                                       : look_.finish.empty() ? Colour{}
                                                              : look_.finish[v],
                                       0.0)});
    geometry_.sources.push_back({number_, v});
    return added;
  }

  const TriangleMesh& mesh_;
  const std::vector<Vec3>& normals_;
  const Look& look_;
  int number_;
  RasterGeometry& geometry_;
};

RasterGeometry::Ball ball_around(const std::vector<Vec3>& places) {
  if (places.empty()) return {};
  RasterGeometry::Ball ball{bounds({places, {}}).centre(), 0.0};
  for (const Vec3& p : places) ball.radius = std::max(ball.radius, length(p - ball.centre));
  return ball;
}

}  // namespace

RasterGeometry raster_geometry(const std::vector<SceneRenderer::DrawnObject>& objects) {
  RasterGeometry geometry;
  for (const bool closed : {true, false}) {
    for (std::size_t o = 0; o < objects.size(); ++o) {
      if (is_closed(objects[o]) == closed) {
        RasterMesh(objects[o], static_cast<int>(o), geometry).add();
      }
    }
    if (closed) geometry.closed_corners = static_cast<std::uint32_t>(geometry.corners.size());
  }
  std::vector<Vec3> all;
  std::vector<Vec3> casters;
  for (const auto& object : objects) {
    const auto& places = object.surface->mesh().vertices;
    all.insert(all.end(), places.begin(), places.end());
    if (!object.is_plane) casters.insert(casters.end(), places.begin(), places.end());
  }
  geometry.all = ball_around(all);
  geometry.casters = casters.empty() ? geometry.all : ball_around(casters);
  return geometry;
}

std::vector<RasterObject> raster_objects(const std::vector<SceneRenderer::DrawnObject>& objects) {
  std::vector<RasterObject> made;
  for (const auto& object : objects) {
    const Look& look = *object.look;
    made.push_back({{look.translucent ? 1.0F : 0.0F,
                     static_cast<float>(look.ior),
                     static_cast<float>(look.surface.specular),
                     static_cast<float>(look.surface.roughness)},
                    vec4(Vec3{}, look.mark_radiance)});
  }
  return made;
}

std::vector<RasterGlow> raster_glow(const std::vector<SceneRenderer::DrawnObject>& objects,
                                    const RasterGeometry& geometry) {
  std::vector<RasterGlow> glow(geometry.vertices.size());
  for (std::size_t i = 0; i < glow.size(); ++i) {
    const auto& [object, v] = geometry.sources[i];
    const Look& look = *objects[object].look;
    if (!look.marks.empty()) glow[i].mark = look.marks[v];
    if (!look.translucent || look.light.fluence.empty()) continue;
    glow[i].fluence = look.light.fluence[v];
    glow[i].flux = look.light.net_flux[v];
  }
  return glow;
}

RasterLights raster_lights(const std::vector<LightOptions>& lights,
                           const RasterGeometry& geometry,
                           int texels) {
  RasterLights all;
  for (const LightOptions& light : lights) {
    if (all.lights.size() == kMostLights) {
      all.left_out.push_back(
          fmt::format("{}: the first {} lights are drawn", light.name, kMostLights));
      continue;
    }
    RasterLight made{};
    made.along = vec4(length(light.direction) > 0.0 ? normalized(light.direction) : Vec3{},
                      static_cast<double>(light.kind));
    made.strength = vec4(strength_of(light), 0.0);
    made.cone = {static_cast<float>(light.cone_degrees * kRadians),
                 static_cast<float>(light.blur_degrees * kRadians),
                 0.0F,
                 static_cast<float>(texels)};
    if (light.kind == LightOptions::Kind::kDisc) {
      all.left_out.push_back(fmt::format(
          "size of {}: what it mirrors and its shadows are those of its middle", light.name));
    }
    double map = -1.0;
    const auto view = light.shadows ? shadow_view(light, geometry, texels) : std::nullopt;
    if (view && all.maps.size() < kShadowMaps) {
      map = static_cast<double>(all.maps.size());
      all.maps.push_back(view->rows);
      made.map = view->rows;
      made.cone[2] = static_cast<float>(view->texel);
    } else if (light.shadows) {
      all.left_out.push_back(
          view ? fmt::format("shadows of {}: {} lights have shadow maps", light.name, kShadowMaps)
               : fmt::format("shadows of {}: it stands within the scene", light.name));
    }
    made.position = vec4(light.position, map);
    all.lights.push_back(made);
  }
  return all;
}

Rows clip_from_scene(
    const CameraModel& camera, int x0, int y0, int width, int height, double near_mm) {
  const auto& r = camera.camera_from_sample.rotation;
  const Vec3 t = camera.camera_from_sample.translation;
  const Vec3 x{r[0], r[1], r[2]};
  const Vec3 y{r[3], r[4], r[5]};
  const Vec3 z{r[6], r[7], r[8]};
  const double ax = 2.0 * camera.fx / width;
  const double bx = 2.0 * (camera.cx - x0) / width - 1.0;
  const double ay = 2.0 * camera.fy / height;
  const double by = 2.0 * (camera.cy - y0) / height - 1.0;
  return {vec4(x * ax + z * bx, ax * t.x + bx * t.z),
          vec4(y * ay + z * by, ay * t.y + by * t.z),
          Vec4f{0.0F, 0.0F, 0.0F, static_cast<float>(near_mm)},
          vec4(z, t.z)};
}

}  // namespace opaline::render
