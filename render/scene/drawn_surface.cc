#include "render/scene/drawn_surface.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/ensure.h"
#include "render/trace/vertex_values.h"

namespace opaline::render {
namespace {

constexpr double kStep = 0.02;      // of an edge, for gradients
constexpr double kBendStep = 1e-3;  // of an edge, for those of a deformation

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) sum += length(mesh.vertices[t[1]] - mesh.vertices[t[0]]);
  return sum / static_cast<double>(mesh.triangles.size());
}

Vec3 onto_surface(Vec3 p, double edge, const SignedDistance& solid) {
  const double distance = solid.at(p);
  if (!(std::abs(distance) <= 0.5 * edge)) return p;
  return p - solid.normal(p, kStep * edge) * distance;
}

std::vector<std::array<float, 3>> spread_values(const std::vector<std::array<float, 3>>& coarse,
                                                const std::vector<std::array<int, 2>>& parents) {
  std::vector<std::array<float, 3>> values = coarse;
  values.reserve(coarse.size() + parents.size());
  for (const auto& [a, b] : parents) {
    std::array<float, 3> mean{};
    for (int c = 0; c < 3; ++c) mean[c] = 0.5F * (values[a][c] + values[b][c]);
    values.push_back(mean);
  }
  return values;
}

}  // namespace

DrawnSurface::DrawnSurface(TriangleMesh mesh)
    : mesh_(std::move(mesh)), normals_(vertex_normals(mesh_)), coarse_(mesh_.vertices.size()) {}

DrawnSurface::DrawnSurface(TriangleMesh coarse, const SignedDistance& solid, int refinement)
    : mesh_(std::move(coarse)), coarse_(mesh_.vertices.size()) {
  for (int k = 0; k < refinement; ++k) refine(solid);
  normals_ = vertex_normals(mesh_);
  const double step = kStep * mean_edge(mesh_);
  for (std::size_t v = 0; v < normals_.size(); ++v) {
    const Vec3 gradient = solid.normal(mesh_.vertices[v], step);
    if (dot(gradient, normals_[v]) > 0.5) normals_[v] = gradient;
  }
}

void DrawnSurface::bend(const Deformation& deformation) {
  if (rest_.empty()) {
    rest_ = mesh_.vertices;
    rest_normals_ = normals_;
  }
  const double step = kBendStep * mean_edge(mesh_);
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    mesh_.vertices[v] = deformation.at(rest_[v]);
    normals_[v] = deformation.normal(rest_[v], rest_normals_[v], step);
  }
}

std::vector<float> DrawnSurface::spread_marks(const std::vector<bool>& of_coarse) const {
  return spread_shares({of_coarse.begin(), of_coarse.end()});
}

std::vector<float> DrawnSurface::spread_shares(std::vector<float> shares) const {
  for (const auto& [a, b] : parents_) shares.push_back(0.5F * (shares[a] + shares[b]));
  return shares;
}

void DrawnSurface::refine(const SignedDistance& solid) {
  std::unordered_map<std::uint64_t, int> middles;
  middles.reserve(mesh_.triangles.size() * 3 / 2);
  const auto middle = [&](int a, int b) {
    const auto key = static_cast<std::uint64_t>(std::min(a, b)) << 32 |
                     static_cast<std::uint64_t>(std::max(a, b));
    const auto [place, fresh] = middles.try_emplace(key, static_cast<int>(mesh_.vertices.size()));
    if (fresh) {
      const Vec3 p = mesh_.vertices[a];
      const Vec3 q = mesh_.vertices[b];
      mesh_.vertices.push_back(onto_surface((p + q) * 0.5, length(q - p), solid));
      parents_.push_back({a, b});
    }
    return place->second;
  };
  std::vector<std::array<int, 3>> finer;
  finer.reserve(4 * mesh_.triangles.size());
  for (const auto& [a, b, c] : mesh_.triangles) {
    const int ab = middle(a, b);
    const int bc = middle(b, c);
    const int ca = middle(c, a);
    for (const auto& triangle : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
      finer.push_back(triangle);
    }
  }
  mesh_.triangles = std::move(finer);
}

SurfaceLight DrawnSurface::spread(const SurfaceLight& of_coarse) const {
  ENSURE(of_coarse.fluence.size() == coarse_);
  return {spread_values(of_coarse.fluence, parents_), spread_values(of_coarse.net_flux, parents_)};
}

}  // namespace opaline::render
