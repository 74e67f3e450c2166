#include "render/mesh/mesh_distance.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "render/mesh/overlap.h"
#include "render/mesh/shapes.h"
#include "tests/render/mesh_samples.h"

namespace opaline::render {
namespace {

std::vector<Vec3> random_points(const Box& box, int count) {
  std::mt19937 generator(7);  // NOLINT(bugprone-random-generator-seed): the same points each time
  std::uniform_real_distribution<double> uniform(-0.2, 1.2);
  std::vector<Vec3> points;
  const Vec3 size = box.size();
  for (int i = 0; i < count; ++i) {
    points.push_back(box.low + Vec3{uniform(generator) * size.x,
                                    uniform(generator) * size.y,
                                    uniform(generator) * size.z});
  }
  return points;
}

double distance_to_box(Vec3 p, double edge) {
  const double h = 0.5 * edge;
  const Vec3 q{std::abs(p.x - h) - h, std::abs(p.y - h) - h, std::abs(p.z - h) - h};
  const Vec3 outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

TEST(MeshDistance, OfACubeIsTheClosedForm) {
  const auto distance = MeshDistance::create(cube_mesh(3.0));
  ASSERT_TRUE(distance);
  for (const Vec3& p : random_points((*distance)->bounds(), 500)) {
    EXPECT_NEAR((*distance)->at(p), distance_to_box(p, 3.0), 1e-12);
  }
}

TEST(MeshDistance, OfAFineSphereIsTheSpheres) {
  const auto distance = MeshDistance::create(sphere_mesh(10.0, 100));
  ASSERT_TRUE(distance);
  for (const Vec3& p : random_points((*distance)->bounds(), 500)) {
    // The facets lie up to R (1 - cos(pi / 200)) = 0.0012 mm inside the sphere, twice that between two rings' diagonals.
    EXPECT_NEAR((*distance)->at(p), length(p) - 10.0, 0.003);
  }
}

TEST(MeshDistance, AMeshInsideOutIsTurnedAround) {
  TriangleMesh cube = cube_mesh(1.0);
  for (auto& t : cube.triangles) std::swap(t[0], t[1]);
  const auto distance = MeshDistance::create(cube);
  ASSERT_TRUE(distance);
  EXPECT_DOUBLE_EQ((*distance)->at({0.5, 0.5, 0.5}), -0.5);
  EXPECT_DOUBLE_EQ((*distance)->at({0.5, 0.5, 1.5}), 0.5);
}

TEST(MeshDistance, AHoleIsClosedAsBySoap) {
  TriangleMesh mesh = sphere_mesh(10.0, 40);
  std::erase_if(mesh.triangles, [&](const auto& t) { return mesh.vertices[t[0]].z > 9.8; });
  ASSERT_GT(topology(mesh).open_edges, 0U);
  const auto distance = MeshDistance::create(mesh);
  ASSERT_TRUE(distance);
  for (const Vec3& p : random_points((*distance)->bounds(), 1000)) {
    if (p.z > 8.0 || std::abs(length(p) - 10.0) < 0.1) continue;
    EXPECT_EQ((*distance)->at(p) < 0.0, length(p) < 10.0) << p.x << " " << p.y << " " << p.z;
  }
}

TEST(MeshDistance, GrowsEvenlyThroughTheFilmOverAHole) {
  TriangleMesh mesh = cube_mesh(10.0);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](int v) { return mesh.vertices[v].z > 9.0; });
  });
  const auto distance = MeshDistance::create(mesh);
  ASSERT_TRUE(distance);
  for (const double x : {3.0, 5.0, 6.5}) {  // of a flat hole the film is flat
    EXPECT_NEAR((*distance)->at({x, 5.0, 10.0}), 0.0, 1e-6);
    EXPECT_NEAR((*distance)->at({x, 5.0, 9.7}), -0.3, 0.03);
    EXPECT_NEAR((*distance)->at({x, 5.0, 10.3}), 0.3, 0.03);
  }
}

TEST(MeshDistance, WhatOverlapsIsOneSolid) {
  TriangleMesh mesh = cube_mesh(2.0);
  append(mesh, cube_mesh(2.0, {1.0, 0.5, 0.5}));
  const auto distance = MeshDistance::create(mesh);
  ASSERT_TRUE(distance);
  for (const Vec3& p : random_points((*distance)->bounds(), 500)) {
    const double expected =
        std::min(distance_to_box(p, 2.0), distance_to_box(p - Vec3{1.0, 0.5, 0.5}, 2.0));
    EXPECT_EQ((*distance)->at(p) < 0.0, expected < 0.0);
  }
}

double buried_in(const TriangleMesh& mesh) {
  const auto distance = MeshDistance::create(mesh);
  EXPECT_TRUE(distance);
  return buried_share(mesh, **distance, {});
}

void turn_over(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
}

TEST(Overlap, IsTheShareOfTheSurfaceThatLiesInside) {
  TriangleMesh cubes = cube_mesh(2.0);
  append(cubes, cube_mesh(2.0, {1.0, 1.0, 1.0}));
  EXPECT_NEAR(buried_in(cubes), 6.0 / 48.0, 0.005);  // three unit squares of each
  turn_over(cubes);
  EXPECT_NEAR(buried_in(cubes), 6.0 / 48.0, 0.005);
  TriangleMesh within = sphere_mesh(2.0, 24);
  append(within, sphere_mesh(1.0, 24));
  EXPECT_NEAR(buried_in(within), 0.2, 0.01);
}

TEST(Overlap, IsNoneOfCavitiesHolesTurnedTrianglesAndPartsApart) {
  TriangleMesh cavity = sphere_mesh(1.0, 24);
  turn_over(cavity);
  append(cavity, sphere_mesh(2.0, 24));
  EXPECT_EQ(buried_in(cavity), 0.0);
  TriangleMesh open = cube_mesh(2.0);
  open.triangles.resize(9);
  EXPECT_EQ(buried_in(open), 0.0);
  TriangleMesh turned = sphere_mesh(1.0, 24);
  std::swap(turned.triangles[7][0], turned.triangles[7][1]);
  EXPECT_EQ(buried_in(turned), 0.0);
  TriangleMesh apart = cube_mesh(1.0);
  append(apart, cube_mesh(1.0, {1.25, 0.0, 0.0}));
  EXPECT_EQ(buried_in(apart), 0.0);
}

TEST(MeshDistance, TrianglesWithoutAreaAreRefused) {
  TriangleMesh mesh = cube_mesh(1.0);
  mesh.triangles = {{0, 0, 1}, {1, 1, 1}};
  EXPECT_FALSE(MeshDistance::create(mesh));
  EXPECT_FALSE(MeshDistance::create({}));
}

TEST(Shapes, ChangeNoFasterThanThePointMovesAndLieInTheirBounds) {
  for (const auto name : shape_names()) {
    const auto shape = make_shape(name, 20.0);
    ASSERT_TRUE(shape) << name;
    const auto points = random_points((*shape)->bounds(), 400);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double moved = length(points[i] - points[i - 1]);
      const double changed = (*shape)->at(points[i]) - (*shape)->at(points[i - 1]);
      EXPECT_LE(std::abs(changed), moved + 1e-9) << name;
      const Vec3 p = points[i];
      const Box box = (*shape)->bounds();
      const bool outside = p.x < box.low.x || p.y < box.low.y || p.z < box.low.z ||
                           p.x > box.high.x || p.y > box.high.y || p.z > box.high.z;
      if (outside) {
        EXPECT_GT((*shape)->at(p), 0.0) << name;
      }
    }
  }
  EXPECT_FALSE(make_shape("teapot", 20.0));
  EXPECT_FALSE(make_shape("sphere", 0.0));
}

TEST(MeshDistance, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  const auto distance = MeshDistance::create(sphere_mesh(10.0, 60), stop.get_token());
  ASSERT_FALSE(distance);
  EXPECT_EQ(distance.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::render
