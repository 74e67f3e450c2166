#include "sim/lamp_mirror.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

double ggx(double cosine, double alpha) {
  const double a = alpha * alpha;
  const double b = cosine * cosine * (a - 1.0) + 1.0;
  return a / (std::numbers::pi * b * b);
}

double smith(double cosine, double alpha) {
  const double tangent = (1.0 - cosine * cosine) / (cosine * cosine);
  return 2.0 / (1.0 + std::sqrt(1.0 + alpha * alpha * tangent));
}

}  // namespace

double mirrored_lamps(std::span<const SphereLight> lamps,
                      const std::vector<double>& power,
                      const MirrorSurface& surface) {
  const double out = dot(surface.normal, surface.to_camera);
  double sum = 0.0;
  for (std::size_t n = 0; n < lamps.size(); ++n) {
    const Vec3 to = lamps[n].position - surface.point;
    const double square = dot(to, to);
    const Vec3 way = to * (1.0 / std::sqrt(square));
    const double in = dot(surface.normal, way);
    if (in <= 0.0 || out <= 0.0 || power[n] == 0.0) continue;
    const Vec3 half = normalized(way + surface.to_camera);
    const double fresnel = reflectance(std::min(1.0, dot(half, way)), 1.0, surface.ior);
    const double alpha = surface.roughness;
    sum += power[n] / square * fresnel * ggx(dot(half, surface.normal), alpha) * smith(in, alpha) *
           smith(out, alpha) / (4.0 * out);
  }
  return sum;
}

}  // namespace opaline::sim
