#include "render/tetrahedra/stuffing.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/mesh/mesh_distance.h"
#include "render/mesh/shapes.h"
#include "tests/render/mesh_samples.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;

/// A solid at another place: the lattice falls on it differently.
class Shifted final : public SignedDistance {
 public:
  Shifted(const SignedDistance& solid, Vec3 shift) : solid_(solid), shift_(shift) {}
  double at(Vec3 p) const override { return solid_.at(p - shift_); }
  Box bounds() const override {  // larger, so that the lattice's origin does not move along
    const Box box = solid_.bounds();
    return {box.low - Vec3{1.0, 1.0, 1.0}, box.high + Vec3{1.0, 1.0, 1.0}};
  }

 private:
  const SignedDistance& solid_;
  Vec3 shift_;
};

TetMesh stuffed(std::string_view shape, double spacing, double growth = 0.0) {
  const auto solid = make_shape(shape, 20.0);
  auto mesh = stuff(**solid, {.spacing_mm = spacing, .interior_growth = growth}, {});
  EXPECT_TRUE(mesh) << shape << ": " << mesh.error().message;
  return mesh ? *std::move(mesh) : TetMesh{};
}

struct Case {
  const char* shape;
  double spacing;
  int genus;
};
constexpr Case kCases[]{{"sphere", 1.5, 0},
                        {"torus", 1.0, 1},
                        {"genus3", 1.0, 3},
                        {"knot", 0.6, 1},
                        {"figurine", 0.8, 0}};

TEST(Stuffing, UniformTetrahedraHaveThePapersAnglesWhereverTheLatticeFalls) {
  for (const Case& c : kCases) {
    const auto solid = make_shape(c.shape, 20.0);
    for (const Vec3 shift : {Vec3{0.0, 0.0, 0.0}, Vec3{0.31, 0.13, 0.77}, Vec3{0.05, 0.5, 0.25}}) {
      const auto mesh = stuff(Shifted(**solid, shift), {.spacing_mm = c.spacing}, {});
      ASSERT_TRUE(mesh);
      const TetQuality quality = quality_of(*mesh);
      EXPECT_GE(quality.smallest_dihedral, 10.7) << c.shape;  // Labelle & Shewchuk, theorem 1
      EXPECT_LE(quality.largest_dihedral, 164.8) << c.shape;
    }
  }
}

TEST(Stuffing, MeshesAreValidWithAClosedSurfaceOfTheRightGenusUniformOrGraded) {
  for (const Case& c : kCases) {
    for (const double growth : {0.0, 0.3, 1.0}) {
      const TetMesh mesh = stuffed(c.shape, c.spacing, growth);
      const auto valid = validate(mesh);
      ASSERT_TRUE(valid) << c.shape << ": " << valid.error().message;
      const MeshTopology surface = topology(surface_mesh(mesh));
      EXPECT_TRUE(surface.watertight()) << c.shape << " K = " << growth;
      EXPECT_EQ(surface.genus, c.genus) << c.shape << " K = " << growth;
      EXPECT_EQ(quality_of(mesh).components, 1) << c.shape;
      EXPECT_NEAR(surface.volume, quality_of(mesh).volume, 1e-9 * surface.volume) << c.shape;
    }
  }
}

TEST(Stuffing, TheVolumeOfASphereConvergesWithTheSquareOfTheSpacing) {
  const double exact = 4.0 / 3.0 * std::numbers::pi * 1000.0;
  const double coarse = 1.0 - quality_of(stuffed("sphere", 2.0)).volume / exact;
  const double fine = 1.0 - quality_of(stuffed("sphere", 1.0)).volume / exact;
  EXPECT_LT(fine, 0.004);
  EXPECT_NEAR(coarse / fine, 4.0, 0.6);
}

TEST(Stuffing, EveryVertexOfTheSurfaceLiesOnIt) {
  for (const Case& c : kCases) {
    const auto solid = make_shape(c.shape, 20.0);
    double worst = 0.0;
    for (const Vec3& p : surface_mesh(stuffed(c.shape, c.spacing)).vertices) {
      worst = std::max(worst, std::abs((*solid)->at(p)));
    }
    EXPECT_LT(worst, 1e-3 * c.spacing)
        << c.shape;  // twelve steps of regula falsi; edges of blocks are the worst
  }
}

TEST(Stuffing, AGradedInteriorHasFewerTetrahedraAndTheSameSurface) {
  const TetMesh uniform = stuffed("sphere", 0.6);
  const TetMesh graded = stuffed("sphere", 0.6, 1.0);
  EXPECT_LT(graded.tets.size(), 0.6 * static_cast<double>(uniform.tets.size()));
  EXPECT_EQ(surface_mesh(graded).triangles.size(), surface_mesh(uniform).triangles.size());
  EXPECT_NEAR(quality_of(graded).volume, quality_of(uniform).volume, 1e-6);
}

TEST(Stuffing, AMeshWithAHoleAndOverlapsIsStuffedAsOneSolid) {
  TriangleMesh mesh = sphere_mesh(5.0, 30);
  append(mesh, cube_mesh(6.0));
  mesh.triangles.erase(mesh.triangles.begin() + 100, mesh.triangles.begin() + 104);
  const auto solid = MeshDistance::create(mesh);
  ASSERT_TRUE(solid);
  const auto tets = stuff(**solid, {.spacing_mm = 0.7}, {});
  ASSERT_TRUE(tets);
  EXPECT_TRUE(validate(*tets));
  EXPECT_EQ(quality_of(*tets).components, 1);
  // Sphere and cube less an eighth of the sphere, which they share (the sphere's radius is less than the cube's edge).
  const double ball = 4.0 / 3.0 * std::numbers::pi * 125.0;
  EXPECT_NEAR(quality_of(*tets).volume, 216.0 + 7.0 / 8.0 * ball, 0.02 * ball);
}

TEST(Stuffing, TwoBodiesAreTwoComponents) {
  TriangleMesh mesh = cube_mesh(4.0);
  append(mesh, cube_mesh(4.0, {8.0, 0.0, 0.0}));
  const auto solid = MeshDistance::create(mesh);
  const auto tets = stuff(**solid, {.spacing_mm = 0.8}, {});
  ASSERT_TRUE(tets);
  EXPECT_EQ(quality_of(*tets).components, 2);
}

TEST(Stuffing, WhatCannotBeDoneIsRefusedWithTheReason) {
  const auto sphere = make_shape("sphere", 20.0);
  EXPECT_THAT(stuff(**sphere, {.spacing_mm = 0.0}, {}).error().message,
              HasSubstr("spacing of 0 mm"));
  EXPECT_THAT(stuff(**sphere, {.spacing_mm = 1e-6}, {}).error().message,
              HasSubstr("larger spacing"));
  EXPECT_THAT(stuff(**sphere, {.spacing_mm = 0.2, .most_tets = 10'000}, {}).error().message,
              HasSubstr("larger spacing"));
  EXPECT_THAT(stuff(**sphere, {.interior_growth = -1.0}, {}).error().message, HasSubstr("K = -1"));
  const auto sheet = make_shape("sheet", 20.0);
  EXPECT_THAT(stuff(Shifted(**sheet, {0.0, 0.0, 0.9}), {.spacing_mm = 6.0}, {}).error().message,
              HasSubstr("smaller spacing"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(stuff(**sphere, {.spacing_mm = 0.2}, stop.get_token()).error().code,
            ErrorCode::kCancelled);
}

TEST(TetMesh, ATwistedOrUnconnectedMeshIsRefusedWithTheReason) {
  TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}},
               {{0, 1, 2, 3}, {1, 2, 3, 4}}};
  EXPECT_TRUE(validate(mesh)) << validate(mesh).error().message;
  EXPECT_EQ(surface_of(mesh).size(), 6U);
  EXPECT_EQ(neighbours_of(mesh)[0][0], 1);
  EXPECT_EQ(neighbours_of(mesh)[1][3], 0);
  std::swap(mesh.tets[1][0], mesh.tets[1][1]);
  EXPECT_THAT(validate(mesh).error().message, HasSubstr("tetrahedron 1 is inverted"));
  mesh.tets[1] = {0, 1, 2, 9};
  EXPECT_THAT(validate(mesh).error().message, HasSubstr("names vertex 9 of 5"));
  EXPECT_THAT(validate(TetMesh{}).error().message, HasSubstr("no tetrahedra"));
}

}  // namespace
}  // namespace opaline::render
