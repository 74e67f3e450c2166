#include "render/scene/specular.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::render {
namespace {

/// exp(-tan^2 a / m^2)
double facets(double cosine, double roughness) {
  const double square = cosine * cosine;
  return std::exp(-(1.0 - square) / (square * roughness * roughness));
}

}  // namespace

double beckmann(double cosine, double roughness) {
  if (!(cosine > 0.0)) return 0.0;
  const double square = cosine * cosine;
  return facets(cosine, roughness) / (std::numbers::pi * roughness * roughness * square * square);
}

double specular_brdf(
    const SurfaceOptions& surface, double ior, Vec3 normal, Vec3 light, Vec3 view) {
  const double nl = dot(normal, light);
  const double nv = dot(normal, view);
  if (surface.specular == SpecularModel::kNone || ior == 1.0 || !(nl > 0.0) || !(nv > 0.0)) {
    return 0.0;
  }
  const Vec3 half = normalized(light + view);
  const double nh = std::min(1.0, dot(normal, half));
  const double vh = std::min(1.0, dot(view, half));
  const double m = surface.roughness;
  const double fresnel = reconstruct::diffusion::fresnel_reflectance(vh, ior);
  if (surface.specular == SpecularModel::kWard) {
    return fresnel * facets(nh, m) / (4.0 * std::numbers::pi * m * m * std::sqrt(nl * nv));
  }
  const double shadow = std::min({1.0, 2.0 * nh * nv / vh, 2.0 * nh * nl / vh});
  return beckmann(nh, m) * shadow * fresnel / (4.0 * nl * nv);
}

}  // namespace opaline::render
