#include "render/scene/lighting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

const double kGolden = std::numbers::pi * (3.0 - std::sqrt(5.0));

double within_cone(const LightOptions& light, Vec3 towards) {
  const double cosine = -dot(normalized(light.direction), towards);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  if (angle >= light.cone_degrees) return 0.0;
  if (angle <= light.cone_degrees - light.blur_degrees) return 1.0;
  const double t = (light.cone_degrees - angle) / light.blur_degrees;
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

bool is_black(const Colour& colour) { return std::ranges::max(colour) <= 0.0; }

LightSample sample(const LightOptions& light, Vec3 place) {
  LightSample found;
  if (light.kind == LightOptions::Kind::kDirectional) {
    found.towards = normalized(light.direction) * -1.0;
    found.irradiance = light.irradiance;
    return found;
  }
  const Vec3 way = light.position - place;
  found.distance = length(way);
  if (!(found.distance > 0.0)) return found;
  found.towards = way * (1.0 / found.distance);
  double share = 1.0 / (found.distance * found.distance);
  if (light.kind == LightOptions::Kind::kSpot) share *= within_cone(light, found.towards);
  if (light.kind == LightOptions::Kind::kDisc) {
    share *= std::max(0.0, -dot(normalized(light.direction), found.towards)) * std::numbers::pi *
             light.radius_mm * light.radius_mm;
  }
  const Colour& strength =
      light.kind == LightOptions::Kind::kDisc ? light.radiance : light.intensity;
  for (int c = 0; c < 3; ++c) found.irradiance[c] = share * strength[c];
  return found;
}

std::vector<LightOptions> parts_of(const LightOptions& light) {
  if (light.kind != LightOptions::Kind::kDisc) return {light};
  std::vector<LightOptions> parts(light.samples, light);
  const Frame frame = frame_around(normalized(light.direction));
  for (int k = 0; k < light.samples; ++k) {
    const double r = light.radius_mm * std::sqrt((k + 0.5) / light.samples);
    parts[k].position = light.position +
                        frame.to_scene({r * std::cos(kGolden * k), r * std::sin(kGolden * k), 0.0});
    parts[k].radius_mm = light.radius_mm / std::sqrt(light.samples);
    parts[k].samples = 1;
  }
  return parts;
}

Vec3 refracted(Vec3 towards, Vec3 normal, double ior) {
  const double cosine = dot(normal, towards);
  const Vec3 tangent = (normal * cosine - towards) * (1.0 / ior);
  return normalized(tangent - normal * std::sqrt(std::max(0.0, 1.0 - dot(tangent, tangent))));
}

std::vector<Vec3> cosine_directions(int count) {
  std::vector<Vec3> directions;
  directions.reserve(count);
  for (int k = 0; k < count; ++k) {
    const double square = (k + 0.5) / count;  // of the sine
    const double sine = std::sqrt(square);
    directions.push_back(
        {sine * std::cos(kGolden * k), sine * std::sin(kGolden * k), std::sqrt(1.0 - square)});
  }
  return directions;
}

Frame frame_around(Vec3 normal) {
  const double sign = std::copysign(1.0, normal.z);
  const double a = -1.0 / (sign + normal.z);
  const double b = normal.x * normal.y * a;
  return {{1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x},
          {b, sign + normal.y * normal.y * a, -normal.y},
          normal};
}

}  // namespace opaline::render
