#include "render/trace/triangle_tree.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "render/mesh/shapes.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

using ::testing::DoubleNear;

TriangleMesh knot() {
  const auto solid = make_shape("knot", 20.0);
  return surface_mesh(*stuff(**solid, {.spacing_mm = 1.5}, {}));
}

/// The distance to the first triangle by Cramer's rule on each: no tree, another formula than Moller's.
double first_by_search(const TriangleMesh& mesh, const Ray& ray) {
  double first = HUGE_VAL;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]];
    const Vec3 b = mesh.vertices[t[1]];
    const Vec3 c = mesh.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a);
    const double distance = dot(a - ray.origin, n) / dot(ray.direction, n);
    const Vec3 p = ray.origin + ray.direction * distance;
    const bool inside = dot(cross(b - a, p - a), n) >= 0.0 && dot(cross(c - b, p - b), n) >= 0.0 &&
                        dot(cross(a - c, p - c), n) >= 0.0;
    if (inside && distance > 0.0) first = std::min(first, distance);
  }
  return first;
}

std::vector<Ray> random_rays(int count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return normalized({normal(random), normal(random), normal(random)});
  };
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const Vec3 origin = direction() * 30.0;
    rays.push_back({origin, normalized(direction() * 8.0 - origin)});
  }
  return rays;
}

TEST(TriangleTreeTest, FindsTheTriangleThatASearchThroughAllOfThemFinds) {
  const TriangleMesh mesh = knot();
  const auto tree = TriangleTree::create(mesh);
  ASSERT_TRUE(tree);
  int met = 0;
  for (const Ray& ray : random_rays(500)) {
    const double truth = first_by_search(mesh, ray);
    const auto hit = tree->nearest(ray);
    ASSERT_EQ(hit.has_value(), std::isfinite(truth));
    if (!hit) continue;
    ++met;
    EXPECT_THAT(hit->distance, DoubleNear(truth, 1e-9));  // 30 mm to rounding
    Vec3 place;
    for (int k = 0; k < 3; ++k) {
      place = place + mesh.vertices[mesh.triangles[hit->triangle][k]] * hit->weights[k];
    }
    EXPECT_LT(length(place - (ray.origin + ray.direction * hit->distance)), 1e-9);
  }
  EXPECT_GT(met, 100);
  EXPECT_LT(met, 450);
}

TEST(TriangleTreeTest, AShadowIsWhereSomethingLiesBetween) {
  const TriangleMesh mesh{{{0, 0, 5}, {4, 0, 5}, {0, 4, 5}}, {{0, 1, 2}}};
  const auto tree = TriangleTree::create(mesh);
  ASSERT_TRUE(tree);
  const Ray up{{1, 1, 0}, {0, 0, 1}};
  EXPECT_TRUE(tree->blocked(up, 0.0));
  EXPECT_TRUE(tree->blocked(up, 0.0, 5.1));
  EXPECT_FALSE(tree->blocked(up, 0.0, 4.9));
  EXPECT_FALSE(tree->blocked(up, 5.1));
  EXPECT_FALSE(tree->blocked({{1, 1, 0}, {0, 0, -1}}, 0.0));
  EXPECT_FALSE(tree->blocked({{3, 3, 0}, {0, 0, 1}}, 0.0));
}

TEST(TriangleTreeTest, RefusesAMeshWithoutTriangles) {
  const TriangleMesh mesh{{{0, 0, 0}}, {}};
  const auto tree = TriangleTree::create(mesh);
  ASSERT_FALSE(tree);
  EXPECT_EQ(tree.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace opaline::render
