#include "bench/render/radiance_error.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>

#include "base/ensure.h"
#include "base/log.h"
#include "bench/figure.h"
#include "bench/render/render_case.h"
#include "bench/stopwatch.h"
#include "reconstruct/diffusion/fresnel.h"
#include "render/trace/triangle_tree.h"
#include "render/trace/vertex_values.h"

namespace opaline::bench {
namespace {

using render::RayHit;
using render::TriangleMesh;
using render::TriangleTree;

constexpr double kIor = 1.3;
constexpr Vec3 kTowards{0.6, 0.48, 0.64};
constexpr double kStepDegrees = 2.0;
constexpr double kNormalStep = 0.02;  // of an edge, for gradients of the distance
using Colour = std::array<double, 3>;

Colour radiance(const render::SurfaceLight& light, std::size_t v) {
  Colour colour{};
  for (int c = 0; c < 3; ++c) colour[c] = light.fluence[v][c] + 3.0 * light.net_flux[v][c];
  return colour;
}

std::optional<RayHit> nearest_along(const TriangleTree& tree,
                                    Vec3 place,
                                    Vec3 normal,
                                    double reach) {
  const auto in = tree.nearest({place + normal * reach, normal * -1.0});
  if (in && in->distance < 2.0 * reach) return in;
  return std::nullopt;
}

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]];
    const double area = 0.5 * length(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
    for (const int v : t) areas[v] += area / 3.0;
  }
  return areas;
}

/// The middles of a mesh's edges, as new vertices of it.
class Middles {
 public:
  explicit Middles(render::TetMesh& mesh) : mesh_(mesh) {}
  int between(int a, int b) {
    const auto [found, is_new] = known_.try_emplace(std::minmax(a, b), 0);
    if (is_new) {
      found->second = static_cast<int>(mesh_.vertices.size());
      mesh_.vertices.push_back((mesh_.vertices[a] + mesh_.vertices[b]) * 0.5);
    }
    return found->second;
  }

 private:
  render::TetMesh& mesh_;
  std::map<std::pair<int, int>, int> known_;
};

std::unique_ptr<render::Subsurface> made(Result<std::unique_ptr<render::Subsurface>> body) {
  ENSURE(body.has_value());
  return *std::move(body);
}

}  // namespace

render::TetMesh cut_into_eight(const render::TetMesh& mesh) {
  render::TetMesh fine{mesh.vertices, {}};
  Middles middles(fine);
  for (const auto& [a, b, c, d] : mesh.tets) {
    const int ab = middles.between(a, b);
    const int ac = middles.between(a, c);
    const int ad = middles.between(a, d);
    const int bc = middles.between(b, c);
    const int bd = middles.between(b, d);
    const int cd = middles.between(c, d);
    fine.tets.insert(fine.tets.end(),
                     {{a, ab, ac, ad}, {ab, b, bc, bd}, {ac, bc, c, cd}, {ad, bd, cd, d}});
    for (const auto& [p, q] : {std::pair{ab, ac}, {ac, cd}, {cd, bd}, {bd, ab}}) {
      const std::array<int, 4> tet{ad, bc, p, q};  // around the octahedron's axis
      fine.tets.push_back(tet);
      if (render::volume_of(fine, fine.tets.size() - 1) < 0.0)
        std::swap(fine.tets.back()[0], fine.tets.back()[1]);
    }
  }
  return fine;
}

LitMarble::LitMarble(std::unique_ptr<render::Subsurface> body,
                     const render::SignedDistance& solid,
                     bool is_followed)
    : solid_(&solid), is_followed_(is_followed), body_(std::move(body)) {
  light_from(0.0);
}

LitMarble::LitMarble(render::TetMesh mesh,
                     const render::SignedDistance& solid,
                     const render::DiffusionOptions& options,
                     ThreadTeam& team)
    : LitMarble(made(render::Subsurface::create(
                    std::move(mesh), solid, marbled_optics, kIor, options, team, {})),
                solid,
                options.directions != 0) {}

LitMarble::LitMarble(const render::SignedDistance& solid,
                     const render::DiffusionOptions& options,
                     ThreadTeam& team)
    : LitMarble(made(render::Subsurface::create(solid, marbled_optics, kIor, options, team, {})),
                solid,
                options.directions != 0) {}

double LitMarble::frame_seconds(int frames) {
  std::vector<double> seconds;
  for (int f = frames - 1; f >= 0; --f) {
    const Stopwatch watch;
    light_from(-kStepDegrees * f);
    seconds.push_back(watch.cpu());
  }
  return median(seconds);
}

void LitMarble::light_from(double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vec3 towards{kTowards.x * std::cos(angle) - kTowards.y * std::sin(angle),
                     kTowards.x * std::sin(angle) + kTowards.y * std::cos(angle),
                     kTowards.z};
  std::vector<std::array<float, 3>> q;
  for (const render::SurfacePlace& place : body_->places()) {
    q.emplace_back().fill(static_cast<float>(std::max(0.0, dot(place.normal, towards))));
  }
  const auto solved = body_->light(q, {}, {});
  if (!solved) log::error("{}", solved.error().message);
  ENSURE(solved.has_value());
}

Colour LitMarble::truth_at(const RayHit& hit) const {
  static const auto boundary = render_boundary();
  const auto& corners = body_->surface().triangles[hit.triangle];
  Vec3 place{};
  Colour fluence{};
  Colour interpolated{};
  for (int k = 0; k < 3; ++k) {
    place = place + body_->surface().vertices[corners[k]] * hit.weights[k];
    const Colour corner = radiance(body_->lit(), corners[k]);
    for (int c = 0; c < 3; ++c) {
      fluence[c] += hit.weights[k] * body_->lit().fluence[corners[k]][c];
      interpolated[c] += hit.weights[k] * corner[c];
    }
  }
  if (is_followed_) return interpolated;
  const Vec3 normal = solid_->normal(place, kNormalStep * body_->report().spacing_mm);
  const double source = boundary.source_scale * std::max(0.0, dot(normal, kTowards));
  Colour radiance{};
  for (int c = 0; c < 3; ++c)
    radiance[c] = fluence[c] + 3.0 * (fluence[c] - source) / (2.0 * boundary.a);
  return radiance;
}

double LitMarble::error_against(const LitMarble& reference) const {
  const TriangleMesh& mesh = body_->surface();
  const auto tree = TriangleTree::create(reference.body_->surface());
  ENSURE(tree.has_value());
  const auto normals = render::vertex_normals(mesh);
  const auto areas = vertex_areas(mesh);
  const double reach = body_->report().spacing_mm;
  double error = 0.0;
  double size = 0.0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto hit = nearest_along(*tree, mesh.vertices[v], normals[v], reach);
    if (!hit) continue;
    const Colour truth = reference.truth_at(*hit);
    const Colour own = radiance(body_->lit(), v);
    for (int c = 0; c < 3; ++c) {
      error += areas[v] * (own[c] - truth[c]) * (own[c] - truth[c]);
      size += areas[v] * truth[c] * truth[c];
    }
  }
  return std::sqrt(error / size);
}

}  // namespace opaline::bench
