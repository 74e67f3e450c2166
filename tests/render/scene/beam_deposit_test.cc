#include "render/scene/beam_deposit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "render/mesh/shapes.h"
#include "render/scene/subsurface.h"
#include "render/tetrahedra/stuffing.h"
#include "sim/tet_transport.h"

namespace opaline::render {
namespace {

constexpr double kScattering = 1.0;
constexpr double kAbsorption = 0.01;
constexpr double kIor = 1.3;

Optics optics() {
  Optics optics;
  optics.absorption.fill(kAbsorption);
  optics.diffusion.fill(1.0 / (3.0 * (kAbsorption + kScattering)));
  return optics;
}

TetMesh sphere(double spacing) {
  const auto solid = make_shape("sphere", 20.0);
  auto mesh = stuff(**solid, {.spacing_mm = spacing}, {});
  EXPECT_TRUE(mesh);
  return *std::move(mesh);
}

/// How far it is through a ball's tetrahedra: to the last face that the ray crosses.
double chord(const BeamDeposit& deposit, Vec3 from, Vec3 along) {
  double farthest = 0.0;
  for (const auto& tet : deposit.mesh().tets) {
    for (int k = 0; k < 4; ++k) {
      const auto face = face_of(tet, k);
      const Vec3 a = deposit.mesh().vertices[face[0]];
      const Vec3 b = deposit.mesh().vertices[face[1]];
      const Vec3 c = deposit.mesh().vertices[face[2]];
      const Vec3 n = cross(b - a, c - a);
      const double distance = dot(a - from, n) / dot(along, n);
      const Vec3 p = from + along * distance;
      const bool inside = dot(cross(b - a, p - a), n) >= 0.0 &&
                          dot(cross(c - b, p - b), n) >= 0.0 && dot(cross(a - c, p - c), n) >= 0.0;
      if (inside) farthest = std::max(farthest, distance);
    }
  }
  return farthest;
}

// Beer's law: alpha' (1 - e^-tau) scatters, on average 1 / sigma_t' - L / (e^tau - 1) from where the beam came in.
TEST(BeamDeposit, ScattersWhatBeersLawTakesWhereItTakesIt) {
  const TetMesh mesh = sphere(2.0);
  const BeamDeposit deposit(mesh, std::vector(mesh.tets.size(), optics()), kIor);
  for (const std::size_t f : {std::size_t{0}, deposit.faces().size() / 2}) {
    const auto& face = deposit.faces()[f];
    const Vec3 along = normalized(face.middle.normal * -1.0 + Vec3{0.2, 0.1, -0.1});
    double sum = 0.0;
    Vec3 moment;
    deposit.follow(deposit.behind({static_cast<int>(f), along, {2.0, 0.0, 0.0}}),
                   [&](const BeamDeposit::Deposit& d) {
                     sum += d.power[0];
                     EXPECT_EQ(d.power[1], 0.0);
                     for (int k = 0; k < 4; ++k) {
                       moment = moment +
                                mesh.vertices[mesh.tets[d.tet][k]] * (d.power[0] * d.corners[0][k]);
                     }
                   });
    const double extinction = kScattering + kAbsorption;
    const double tau = extinction * chord(deposit, face.middle.place, along);
    EXPECT_NEAR(
        sum, 2.0 * kScattering / extinction * -std::expm1(-tau), 5e-4);  // a ten-thousandth is left
    const double depth = 1.0 / extinction - tau / extinction / std::expm1(tau);
    const Vec3 off = moment * (1.0 / sum) - (face.middle.place + along * depth);
    EXPECT_LT(length(off), 5e-3);
  }
}

/// A ball of the same matter in light from above, which is transmitted and refracted.
struct LitBall {
  TetMesh mesh;
  std::vector<Beam> beams;
  sim::TetSolid traced;
  std::vector<double> power;  // into each face
  double entered = 0.0;
};

LitBall lit_ball(double spacing) {
  LitBall ball{sphere(spacing), {}, {}, {}};
  const BeamDeposit deposit(ball.mesh, std::vector(ball.mesh.tets.size(), optics()), kIor);
  for (std::size_t f = 0; f < deposit.faces().size(); ++f) {
    const auto& face = deposit.faces()[f];
    const Vec3 n = face.middle.normal;
    const double watts = face.area * std::max(0.0, n.z);  // as if all of it passed
    ball.entered += watts;
    const Vec3 tangent = (n * n.z - Vec3{0.0, 0.0, 1.0}) * (1.0 / kIor);
    const Vec3 along = tangent - n * std::sqrt(1.0 - dot(tangent, tangent));
    if (watts > 0.0) ball.beams.push_back({static_cast<int>(f), along, {watts, watts, watts}});
  }
  ball.traced = {ball.mesh.vertices,
                 ball.mesh.tets,
                 std::vector(ball.mesh.tets.size(), kAbsorption),
                 std::vector(ball.mesh.tets.size(), kScattering),
                 kIor};
  for (const auto& [tet, opposite] : sim::surface_faces(ball.traced)) {
    const auto face = face_of(ball.mesh.tets[tet], opposite);
    const Vec3 a = ball.mesh.vertices[face[0]];
    const Vec3 n = cross(ball.mesh.vertices[face[1]] - a, ball.mesh.vertices[face[2]] - a) * 0.5;
    ball.power.push_back(std::max(0.0, n.z));
  }
  return ball;
}

// Single scattering along the refracted ray against the first collisions of Monte Carlo through the same tetrahedra, in layers of
// 2 mm across the light. 96,000 photons are sure of a layer with a tenth of the light to 1 %, of one with a hundredth to 3 %.
TEST(BeamDeposit, LightScattersFirstWhereMonteCarloHasItsFirstCollisions) {
  const LitBall ball = lit_ball(1.25);
  const BeamDeposit deposit(ball.mesh, std::vector(ball.mesh.tets.size(), optics()), kIor);
  const auto truth = sim::trace_tets(
      ball.traced,
      ball.power,
      std::vector(ball.power.size(), 0),
      {.entry = sim::TetEntry::kCollimated, .count_first = true, .photons = 96'000, .threads = 2},
      {});
  ASSERT_TRUE(truth) << truth.error().message;
  const auto layer_of = [&](int tet) {
    const Vec3 p = centroid_of(ball.mesh, static_cast<std::size_t>(tet));
    return static_cast<std::size_t>((10.0 - p.z) / 2.0);
  };
  std::array<double, 10> ours{};
  std::array<double, 10> traced{};
  for (const Beam& beam : ball.beams) {
    deposit.follow(deposit.behind(beam), [&](const BeamDeposit::Deposit& d) {
      ours.at(layer_of(d.tet)) += d.power[0] / ball.entered;
    });
  }
  for (std::size_t t = 0; t < truth->first.size(); ++t) {
    traced.at(layer_of(static_cast<int>(t))) += truth->first[t];
  }
  double all = 0.0;
  for (std::size_t k = 0; k < ours.size(); ++k) {
    EXPECT_NEAR(ours[k], traced[k], 0.03 * traced[k] + 1e-3) << k;
    all += traced[k];
  }
  EXPECT_GT(all, 0.9);  // of what entered; the rest is absorbed first, or leaves unscattered
}

// At sigma_a = 0.01 per mm diffusion with its collimated source is within 2.5 % of transport on slabs (docs/physics.md); 64,000 photons are sure of a
// half's light to 0.5 %.
TEST(BeamDeposit, ABallInCollimatedLightSendsOutWhatMonteCarloFinds) {
  const auto solid = make_shape("sphere", 20.0);
  const LitBall ball = lit_ball(1.5);
  ThreadTeam team(2);
  const auto body = Subsurface::create(ball.mesh,
                                       **solid,
                                       [](Vec3) { return optics(); },
                                       kIor,
                                       {.spacing_mm = 1.5, .interior_growth = 0.0},
                                       team,
                                       {});
  ASSERT_TRUE(body) << body.error().message;
  const std::vector<std::array<float, 3>> dark((*body)->places().size());
  ASSERT_TRUE((*body)->light(dark, ball.beams, {}));
  std::array<double, 2> diffused{};
  const TriangleMesh& surface = (*body)->surface();
  for (const auto& t : surface.triangles) {
    const Vec3 a = surface.vertices[t[0]];
    const double area = 0.5 * length(cross(surface.vertices[t[1]] - a, surface.vertices[t[2]] - a));
    const double z = a.z + surface.vertices[t[1]].z + surface.vertices[t[2]].z;
    for (const int v : t) diffused[z > 0.0 ? 0 : 1] += area / 3.0 * (*body)->lit().net_flux[v][0];
  }
  std::vector<int> half;
  for (const auto& [tet, opposite] : sim::surface_faces(ball.traced)) {
    double z = 0.0;
    for (const int v : face_of(ball.mesh.tets[tet], opposite)) z += ball.mesh.vertices[v].z;
    half.push_back(z > 0.0 ? 0 : 1);
  }
  const auto truth = sim::trace_tets(ball.traced,
                                     ball.power,
                                     half,
                                     {.entry = sim::TetEntry::kCollimated,
                                      .count_unscattered = false,
                                      .photons = 64'000,
                                      .threads = 2},
                                     {});
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_NEAR(diffused[0] / ball.entered, truth->left[0], 0.03 * truth->left[0]);
  EXPECT_NEAR(diffused[1] / ball.entered, truth->left[1], 0.03 * truth->left[1]);
}

}  // namespace
}  // namespace opaline::render
