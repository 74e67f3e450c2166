#include "render/scene/creases.h"

namespace opaline::render {
namespace {

constexpr double kInto = 0.2;         // of the way from a place to the triangle's middle
constexpr double kWhole = 0.95;       // of the way gone; a right angle leaves 0.71
constexpr double kNormalStep = 0.02;  // of a place's size, for gradients of the distance

Vec3 area_of(const TriangleMesh& surface, std::size_t triangle) {
  const auto& [i, j, k] = surface.triangles[triangle];
  const Vec3 a = surface.vertices[i];
  return cross(surface.vertices[j] - a, surface.vertices[k] - a) * 0.5;
}

Vec3 middle_of(const TriangleMesh& surface, std::size_t triangle) {
  const auto& [i, j, k] = surface.triangles[triangle];
  return (surface.vertices[i] + surface.vertices[j] + surface.vertices[k]) * (1.0 / 3.0);
}

/// Whether the distance has no one gradient about a place: central differences over two faces are shorter than it goes.
bool is_between_faces(const SignedDistance& solid, const SurfacePlace& place) {
  const double step = kNormalStep * place.size;
  const Vec3 along = place.normal * step;
  return solid.at(place.place + along) - solid.at(place.place - along) < kWhole * 2.0 * step;
}

/// The normal beside a place on a triangle, or the place's own where there is no crease between them.
Vec3 normal_beside(const SignedDistance& solid,
                   const SurfacePlace& place,
                   Vec3 facet,
                   Vec3 middle) {
  if (dot(facet, place.normal) > Creases::kCrease) return place.normal;
  if (!is_between_faces(solid, place)) return place.normal;
  const Vec3 beside = place.place + (middle - place.place) * kInto;
  const Vec3 gradient = solid.normal(beside, kNormalStep * place.size);
  const Vec3 normal = dot(gradient, facet) > 0.5 ? gradient : facet;
  return dot(normal, place.normal) > Creases::kCrease ? place.normal : normal;
}

}  // namespace

Creases Creases::split(const SignedDistance& solid,
                       const TriangleMesh& surface,
                       std::vector<SurfacePlace>& places,
                       std::vector<TrianglePlaces>& triangles) {
  Creases creases;
  std::vector<bool> is_creased(surface.vertices.size(), false);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3 area = area_of(surface, t);
    if (!(length(area) > 0.0)) continue;
    for (std::size_t k = 0; k < triangles[t].size(); ++k) {
      const int own = triangles[t][k];
      if (own < 0) continue;
      const SurfacePlace place = places[own];
      const Vec3 normal = normal_beside(solid, place, normalized(area), middle_of(surface, t));
      if (dot(normal, place.normal) > kCrease) continue;
      creases.parts_.push_back({static_cast<int>(t), own});
      triangles[t][k] = static_cast<int>(places.size());
      places.push_back({place.place, normal, place.size});
      if (k < 3) is_creased[surface.triangles[t][k]] = true;
    }
  }
  std::vector<int> number(surface.vertices.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int v = surface.triangles[t][k];
      if (!is_creased[v]) continue;
      if (number[v] < 0) {
        number[v] = static_cast<int>(creases.corners_.size());
        creases.corners_.push_back({v, {}, {}});
      }
      Corner& corner = creases.corners_[number[v]];
      corner.places.push_back(triangles[t][k]);
      corner.weights.push_back(static_cast<float>(length(area_of(surface, t))));
    }
  }
  for (Corner& corner : creases.corners_) {
    float sum = 0.0F;
    for (const float w : corner.weights) sum += w;
    for (float& w : corner.weights) w /= sum;
  }
  return creases;
}

void Creases::append(const TriangleMesh& surface, std::vector<SurfacePlace>& places) const {
  for (const Part& part : parts_) {
    const SurfacePlace place = places[part.place];
    places.push_back({place.place, normalized(area_of(surface, part.triangle)), place.size});
  }
}

}  // namespace opaline::render
