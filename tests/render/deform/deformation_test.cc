#include "render/deform/deformation.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace opaline::render {
namespace {

using ::testing::HasSubstr;
using Kind = DeformOptions::Kind;

const Box kBox{{-1.0, -2.0, -3.0}, {1.0, 2.0, 3.0}};

void expect_near(Vec3 a, Vec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Cage, WithAllPointsMovedAlikeMovesTheBody) {
  DeformOptions options;
  options.kind = Kind::kCage;
  options.points = {3, 4, 2};
  options.handles = {{.point = {-1, -1, -1}, .move = {1.0, 2.0, 3.0}}};
  const auto cage = make_deformation(options, kBox, {});
  ASSERT_TRUE(cage) << cage.error().message;
  expect_near((*cage)->at({0.3, 1.4, -2.0}), {1.3, 3.4, 1.0}, 1e-12);
}

// Linear precision of Bernstein polynomials: control points moved by their own place double the body.
TEST(Cage, WithPointsMovedLinearlyStretchesTheBodyLinearly) {
  DeformOptions options;
  options.kind = Kind::kCage;
  for (int k = 0; k < 3; ++k) {
    options.handles.push_back({.point = {-1, -1, k}, .move = {0.0, 0.0, 3.0 * (k - 1)}});
  }
  const auto cage = make_deformation(options, kBox, {});
  ASSERT_TRUE(cage);
  expect_near((*cage)->at({0.3, 1.4, -2.1}), {0.3, 1.4, -4.2}, 1e-12);
  const double c = std::sqrt(0.5);  // a slope of 1 becomes one of 2, its normal (-2, 1)
  expect_near((*cage)->normal({0.1, 0.2, 0.3}, {-c, 0.0, c}, 1e-3),
              {-2.0 / std::sqrt(5.0), 0.0, 1.0 / std::sqrt(5.0)},
              1e-9);
}

TEST(Cage, MovesTheMiddleByTheBernsteinWeightOfItsPoint) {
  DeformOptions options;
  options.kind = Kind::kCage;
  options.handles = {{.point = {1, 1, 1}, .move = {0.0, 0.0, 8.0}}};
  const auto cage = make_deformation(options, kBox, {});
  ASSERT_TRUE(cage);
  expect_near((*cage)->at({}), {0.0, 0.0, 1.0}, 1e-12);  // (2 / 4)^3 of 8
}

TEST(Skeleton, OfOneBoneTurnsTheBodyAboutItsHead) {
  DeformOptions options;
  options.kind = Kind::kBones;
  options.bones = {
      {.head = {1.0, 0.0, 0.0}, .tail = {2.0, 0.0, 0.0}, .rotation_degrees = {0.0, 0.0, 90.0}}};
  const auto bones = make_deformation(options, kBox, {});
  ASSERT_TRUE(bones) << bones.error().message;
  expect_near((*bones)->at({3.0, 0.0, 0.5}), {1.0, 2.0, 0.5}, 1e-12);
  expect_near((*bones)->normal({3.0, 0.0, 0.5}, {1.0, 0.0, 0.0}, 1e-3), {0.0, 1.0, 0.0}, 1e-9);
}

TEST(Skeleton, CarriesAChildWithItsParent) {
  DeformOptions options;
  options.kind = Kind::kBones;
  options.bones = {{.name = "a",
                    .head = {0.0, 0.0, 0.0},
                    .tail = {1.0, 0.0, 0.0},
                    .rotation_degrees = {0.0, 0.0, 90.0}},
                   {.name = "b",
                    .parent = "a",
                    .head = {1.0, 0.0, 0.0},
                    .tail = {2.0, 0.0, 0.0},
                    .rotation_degrees = {0.0, 0.0, 90.0}}};
  const auto bones = make_deformation(options, kBox, {});
  ASSERT_TRUE(bones);
  expect_near((*bones)->at({2.0, 0.0, 0.0}), {-1.0, 1.0, 0.0}, 1e-6);  // on b alone
  options.amount = 0.0;
  expect_near((*make_deformation(options, kBox, {}))->at({0.7, 0.4, 0.1}), {0.7, 0.4, 0.1}, 1e-12);
}

TEST(Deformation, IsToldInTheObjectsOwnFrame) {
  DeformOptions options;
  options.kind = Kind::kCage;
  options.handles = {{.point = {-1, -1, -1}, .move = {1.0, 0.0, 0.0}}};
  Pose turned;  // a quarter about z: x becomes y
  turned.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  turned.translation = {5.0, 0.0, 0.0};
  const auto cage = make_deformation(options, kBox, turned);
  ASSERT_TRUE(cage);
  expect_near((*cage)->at({5.0, 1.0, 0.0}), {5.0, 2.0, 0.0}, 1e-12);
}

TEST(Deformation, SaysWhatIsWrongWithItsHandles) {
  DeformOptions options;
  options.kind = Kind::kCage;
  options.handles = {{.point = {0, 3, 0}, .move = {}}};
  EXPECT_THAT(validate(options).error().message, HasSubstr("handle 1: point 3 of 3 along axis 1"));
  options.kind = Kind::kBones;
  EXPECT_THAT(validate(options).error().message, HasSubstr("at least one"));
  options.bones = {{.name = "a", .parent = "b", .tail = {1.0, 0.0, 0.0}}};
  EXPECT_THAT(validate(options).error().message, HasSubstr("no bone \"b\" before it"));
  options.bones = {{.name = "a"}};
  EXPECT_THAT(validate(options).error().message, HasSubstr("head and tail are one place"));
}

}  // namespace
}  // namespace opaline::render
