#include "render/scene/single_scattering.h"

#include <algorithm>

#include "reconstruct/diffusion/fresnel.h"
#include "render/scene/lighting.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::fresnel_reflectance;
using reconstruct::diffusion::refracted_cosine;

constexpr double kTogether = 0.015;  // of what a ray scatters, looked at in one place
constexpr double kDeepest = 0.2;     // optical depth between two places
constexpr int kMostTurns = 5;
constexpr double kSame = 1.0 - 1e-6;  // cosine between directions

}  // namespace

Colour SingleScattering::seen(std::size_t triangle, Vec3 place, Vec3 along) const {
  const std::size_t finer = drawn_.mesh().triangles.size() / surface_.triangles.size();
  const int tet = inside_.faces()[triangle / finer].tet;
  Colour sum{};
  Colour power{};  // scattered since the beams were last looked at, and where, times how much
  Vec3 moment;
  double weight = 0.0;
  int last = tet;
  const auto take = [&] {
    if (!(weight > 0.0)) return;
    const Colour phi = beams(last, moment * (1.0 / weight));
    for (int c = 0; c < 3; ++c) sum[c] += power[c] * phi[c];
    power = {};
    moment = {};
    weight = 0.0;
  };
  const TetMesh& mesh = inside_.mesh();
  inside_.follow(InnerBeam{tet, place, along, {1.0, 1.0, 1.0}, kDeepest},
                 [&](const BeamDeposit::Deposit& d) {
                   const double most = std::ranges::max(d.power);
                   if (weight + most > kTogether) take();
                   for (int k = 0; k < 4; ++k) {
                     const Vec3 corner = mesh.vertices[mesh.tets[d.tet][k]];
                     for (int c = 0; c < 3; ++c)
                       moment = moment + corner * (d.corners[c][k] * most / 3.0);
                   }
                   for (int c = 0; c < 3; ++c) power[c] += d.power[c];
                   weight += most;
                   last = d.tet;
                 });
  take();
  return sum;
}

Colour SingleScattering::beams(int tet, Vec3 place) const {
  Colour sum{};
  for (const LightOptions& lamp : lamps_) {
    const Colour phi = beam(lamp, tet, place);
    for (int c = 0; c < 3; ++c) sum[c] += phi[c];
  }
  return sum;
}

Colour SingleScattering::beam(const LightOptions& lamp, int tet, Vec3 place) const {
  Vec3 along = sample(lamp, place).towards;
  for (int turn = 0;; ++turn) {
    const BeamDeposit::WayOut way = inside_.way_out(tet, place, along);
    if (way.face < 0) return {};
    const SurfacePlace entry = smooth(way.face, way.place);
    const LightSample from = sample(lamp, entry.place);
    const double cosine = dot(entry.normal, from.towards);
    if (!(cosine > 0.0) || is_black(from.irradiance)) return {};
    const Vec3 next = refracted(from.towards, entry.normal, ior_) * -1.0;
    if (dot(next, along) < kSame && turn < kMostTurns) {
      along = next;
      continue;
    }
    if (lamp.shadows && surfaces_.hides(entry, from.towards, from.distance)) return {};
    const double mu = std::min(1.0, cosine);
    const double share = (1.0 - fresnel_reflectance(mu, ior_)) * mu / refracted_cosine(mu, ior_);
    Colour phi{};
    for (int c = 0; c < 3; ++c) phi[c] = share * from.irradiance[c] * way.left[c];
    return phi;
  }
}

SurfacePlace SingleScattering::smooth(int face, Vec3 place) const {
  const SurfacePlace& flat = inside_.faces()[face].middle;
  const auto& corners = surface_.triangles[face];
  Vec3 normal;
  for (int k = 0; k < 3; ++k) {
    const Vec3& own = drawn_.normals()[corners[k]];
    if (!(dot(own, flat.normal) > Surfaces::kCrease)) return {place, flat.normal, flat.size};
    const Vec3 b = surface_.vertices[corners[(k + 1) % 3]] - place;
    const Vec3 c = surface_.vertices[corners[(k + 2) % 3]] - place;
    normal = normal + own * std::max(0.0, dot(cross(b, c), flat.normal));
  }
  return {place, normalized(normal), flat.size};
}

}  // namespace opaline::render
