#include "render/scene/surfaces.h"

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr double kLift = 1e-3;  // of a place's size, above the surface
constexpr double kSkip = 0.25;  // of a place's size, along the ray

}  // namespace

int Surfaces::add(const TriangleMesh& mesh, const std::vector<Vec3>& normals) {
  const auto object = static_cast<int>(first_vertices_.size());
  const auto first = static_cast<int>(mesh_.vertices.size());
  first_vertices_.push_back(first);
  first_triangles_.push_back(mesh_.triangles.size());
  mesh_.vertices.insert(mesh_.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  normals_.insert(normals_.end(), normals.begin(), normals.end());
  for (const auto& [a, b, c] : mesh.triangles)
    mesh_.triangles.push_back({first + a, first + b, first + c});
  objects_.resize(mesh_.triangles.size(), static_cast<std::uint16_t>(object));
  return object;
}

void Surfaces::move(int object,
                    const std::vector<Vec3>& vertices,
                    const std::vector<Vec3>& normals) {
  std::ranges::copy(vertices, mesh_.vertices.begin() + first_vertices_[object]);
  std::ranges::copy(normals, normals_.begin() + first_vertices_[object]);
  tree_->refit();
}

Result<void> Surfaces::build(const std::stop_token& stop) {
  auto tree = TriangleTree::create(mesh_, stop);
  if (!tree) return tree.error();
  tree_.emplace(*std::move(tree));
  return ok();
}

Vec3 Surfaces::curved(const std::array<int, 3>& corners,
                      const std::array<double, 3>& weights) const {
  Vec3 flat;
  for (int k = 0; k < 3; ++k) flat = flat + mesh_.vertices[corners[k]] * weights[k];
  Vec3 sum = flat;
  for (int k = 0; k < 3; ++k) {
    const double below = dot(flat - mesh_.vertices[corners[k]], normals_[corners[k]]);
    sum = sum - normals_[corners[k]] * (weights[k] * std::min(0.0, below));
  }
  return sum;
}

std::optional<Surfaces::Hit> Surfaces::nearest(const Ray& ray) const {
  const auto found = tree_->nearest(ray);
  if (!found) return std::nullopt;
  const auto& corners = mesh_.triangles[found->triangle];
  Hit hit{.object = objects_[found->triangle], .weights = found->weights};
  hit.triangle = found->triangle - first_triangles_[hit.object];
  const Vec3 a = mesh_.vertices[corners[0]];
  const Vec3 area = cross(mesh_.vertices[corners[1]] - a, mesh_.vertices[corners[2]] - a);
  hit.facet = normalized(area);
  const bool creased =
      std::ranges::any_of(corners, [&](int v) { return !(dot(normals_[v], hit.facet) > kCrease); });
  for (int k = 0; k < 3; ++k) {
    hit.vertices[k] = corners[k] - first_vertices_[hit.object];
    hit.place = hit.place + mesh_.vertices[corners[k]] * hit.weights[k];
    hit.normal = hit.normal + (creased ? hit.facet : normals_[corners[k]]) * hit.weights[k];
  }
  hit.normal = normalized(hit.normal);
  hit.start = {
      creased ? hit.place : curved(corners, hit.weights), hit.normal, std::sqrt(length(area))};
  return hit;
}

bool Surfaces::hides(const SurfacePlace& from, Vec3 towards, double distance) const {
  const Vec3 origin = from.place + from.normal * (kLift * from.size);
  return tree_->blocked({origin, towards}, kSkip * from.size, distance);
}

}  // namespace opaline::render
