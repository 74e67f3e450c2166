#include "sim/tet_transport.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

using ::testing::HasSubstr;

/// A box around the z axis, its top at z = 0, cut into n x n x 1 blocks of six tetrahedra each.
TetSolid slab(double width, double thickness, int n) {
  TetSolid solid;
  const double step = width / n;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        solid.vertices.push_back({i * step - 0.5 * width, j * step - 0.5 * width, -k * thickness});
      }
    }
  }
  const auto at = [n](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const std::array v{at(i, j, 0),
                         at(i + 1, j, 0),
                         at(i, j + 1, 0),
                         at(i + 1, j + 1, 0),
                         at(i, j, 1),
                         at(i + 1, j, 1),
                         at(i, j + 1, 1),
                         at(i + 1, j + 1, 1)};
      for (const auto& [a, b] : {std::pair{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}) {
        solid.tets.push_back({v[0], v[a], v[b], v[7]});  // around the diagonal
      }
    }
  }
  return solid;
}

struct Outcome {
  double reflected = 0.0;
  double transmitted = 0.0;
  double sides = 0.0;
  double absorbed = 0.0;
  double unscattered = 0.0;
};

/// Light on a small square of the top's middle.
Outcome through(TetSolid solid,
                double scattering,
                double absorption,
                const TetTransportOptions& options) {
  solid.scattering.assign(solid.tets.size(), scattering);
  solid.absorption.assign(solid.tets.size(), absorption);
  const auto faces = surface_faces(solid);
  std::vector<double> power;
  std::vector<int> patch;
  double lowest = 0.0;
  for (const Vec3& p : solid.vertices) lowest = std::min(lowest, p.z);
  for (const auto& [tet, opposite] : faces) {
    Vec3 centre;
    bool top = true;
    bool bottom = true;
    for (int k = 0; k < 4; ++k) {
      if (k == opposite) continue;
      const Vec3 p = solid.vertices[solid.tets[tet][k]];
      centre = centre + p * (1.0 / 3.0);
      top &= p.z == 0.0;
      bottom &= p.z == lowest;
    }
    patch.push_back(top ? 0 : bottom ? 1 : 2);
    power.push_back(top && std::hypot(centre.x, centre.y) < 1.5 ? 1.0 : 0.0);
  }
  const auto result = trace_tets(solid, power, patch, options, {});
  EXPECT_TRUE(result) << result.error().message;
  return {result->left[0], result->left[1], result->left[2], result->absorbed, result->unscattered};
}

// docs/physics.md, discrete ordinates: collimated light on a slab of 5 mm, eta = 1.3, sigma_s' = 1, sigma_a = 0.01 per mm,
// unscattered light left out: T = 0.245, R = 0.5944. 60,000 photons: a standard error of 0.002.
TEST(TetTransport, ASlabPassesAndReturnsWhatDiscreteOrdinatesSay) {
  TetSolid solid = slab(120.0, 5.0, 81);
  solid.ior = 1.3;
  const Outcome o = through(solid,
                            1.0,
                            0.01,
                            {.entry = TetEntry::kCollimated,
                             .count_unscattered = false,
                             .photons = 60'000,
                             .threads = 2});
  EXPECT_NEAR(o.transmitted, 0.245, 0.006);
  EXPECT_NEAR(o.reflected, 0.5944, 0.006);
  EXPECT_LT(o.sides, 1e-3);
  EXPECT_NEAR(o.transmitted + o.reflected + o.sides + o.absorbed + o.unscattered, 1.0, 0.01);
}

// Giovanelli: a half space of n = 1.5, albedo 0.9, returns 0.26 with the 0.04 that its surface mirrors.
TEST(TetTransport, AHalfSpaceReturnsWhatGiovanelliFound) {
  TetSolid solid = slab(60.0, 20.0, 41);
  solid.ior = 1.5;
  const Outcome o =
      through(solid, 9.0, 1.0, {.entry = TetEntry::kCollimated, .photons = 60'000, .threads = 2});
  EXPECT_NEAR(0.04 + 0.96 * o.reflected, 0.26, 0.006);
}

TEST(TetTransport, WithoutCollisionsLightGoesStraightAndIsRefracted) {
  TetSolid solid = slab(120.0, 5.0, 81);
  const Outcome o =
      through(solid,
              0.0,
              0.1,
              {.entry = TetEntry::kCollimated, .direction = {1.0, 0.0, -1.0}, .photons = 6400});
  EXPECT_NEAR(o.transmitted, std::exp(-0.1 * 5.0 * std::sqrt(2.0)), 1e-9);
  EXPECT_DOUBLE_EQ(o.unscattered, o.transmitted);
}

// What absorbs and does not scatter: of light at sin^2 = s outside, e = exp(-sigma_a d / cos) is left on each way across, so
// (1 - R) e / (1 - R^2 e^2) of what entered leaves below, and R e times that above; the means over s have the weight 1 - R.
TEST(TetTransport, DiffuseLightFillsTheRefractedCone) {
  constexpr double kIor = 1.5;
  constexpr double kDepth = 0.5;
  constexpr int kNodes = 2000;
  double entered = 0.0;
  double below = 0.0;
  double above = 0.0;
  for (int k = 0; k < kNodes; ++k) {
    const double s = (k + 0.5) / kNodes;
    const double mirrored = reflectance(std::sqrt(1.0 - s), 1.0, kIor);
    const double e = std::exp(-kDepth / std::sqrt(1.0 - s / (kIor * kIor)));
    const double out =
        (1.0 - mirrored) * (1.0 - mirrored) * e / (1.0 - mirrored * mirrored * e * e);
    entered += 1.0 - mirrored;
    below += out;
    above += mirrored * e * out;
  }
  TetSolid solid = slab(120.0, 5.0, 81);
  solid.ior = kIor;
  const Outcome o =
      through(solid, 0.0, kDepth / 5.0, {.entry = TetEntry::kDiffuse, .photons = 60'000});
  EXPECT_NEAR(o.transmitted, below / entered, 0.002);  // three standard errors
  EXPECT_NEAR(o.reflected, above / entered, 0.0015);
}

TEST(TetTransport, DoesNotDependOnThreadsAndRefusesWhatMakesNoSense) {
  const TetSolid solid = slab(30.0, 5.0, 21);
  const Outcome one = through(solid, 1.0, 0.01, {.photons = 6400, .threads = 1});
  const Outcome three = through(solid, 1.0, 0.01, {.photons = 6400, .threads = 3});
  EXPECT_EQ(one.reflected, three.reflected);
  EXPECT_EQ(one.absorbed, three.absorbed);
  TetSolid bare = solid;
  EXPECT_THAT(trace_tets(bare, {}, {}, {}, {}).error().message, HasSubstr("one absorption"));
  bare.absorption = bare.scattering = std::vector(bare.tets.size(), 1.0);
  EXPECT_THAT(trace_tets(bare, {}, {}, {}, {}).error().message, HasSubstr("power and patch"));
}

}  // namespace
}  // namespace opaline::sim
