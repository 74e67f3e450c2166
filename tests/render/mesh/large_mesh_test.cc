#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <string>

#include "render/mesh/mesh_distance.h"
#include "render/mesh/read_mesh.h"
#include "render/mesh/shapes.h"
#include "render/tetrahedra/stuffing.h"
#include "tests/render/mesh_samples.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;

TEST(LargeMesh, TenMillionTrianglesAreTheSolidThatTheyEnclose) {
  constexpr double kRadius = 10.0;
  constexpr int kRings = 1582;
  std::unique_ptr<MeshDistance> solid;
  {
    const TriangleMesh mesh = sphere_mesh(kRadius, kRings);
    ASSERT_GE(mesh.triangles.size(), 10'000'000U);
    auto made = MeshDistance::create(mesh);
    ASSERT_TRUE(made) << made.error().message;
    solid = *std::move(made);
  }
  const double sagitta = kRadius * std::pow(std::numbers::pi / kRings, 2);  // of a facet, and more
  for (const Vec3 p :
       {Vec3{0.0, 0.0, 0.0}, {3.0, -4.0, 5.0}, {0.0, 0.0, -9.99}, {12.0, 9.0, 2.0}}) {
    EXPECT_NEAR(solid->at(p), length(p) - kRadius, sagitta);
  }
  const auto tets = stuff(*solid, {.spacing_mm = 2.5}, {});
  ASSERT_TRUE(tets) << tets.error().message;
  const auto of_a_sphere =
      stuff(*make_shape("sphere", 2.0 * kRadius).value(), {.spacing_mm = 2.5}, {});
  EXPECT_EQ(tets->tets.size(), of_a_sphere->tets.size());
  EXPECT_NEAR(quality_of(*tets).volume, quality_of(*of_a_sphere).volume, 0.1);
}

TEST(LargeMesh, MoreThanTwentyMillionTrianglesAreRefusedWithTheReason) {
  constexpr std::uint32_t kCorners = 20'000'003;  // of one polygon, cut into a fan of two less
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\n"
      "property char z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n";
  file.append({0, 0, 0, 1, 0, 0, 0, 1, 0});
  for (int byte = 0; byte < 4; ++byte) file.push_back(static_cast<char>(kCorners >> (8 * byte)));
  for (std::uint32_t k = 0; k < kCorners; ++k) file.push_back(static_cast<char>(k % 3));
  const auto mesh = decode_mesh("ply", file);
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(mesh.error().message, HasSubstr("20000001 triangles; at most 20000000"));
}

}  // namespace
}  // namespace opaline::render
