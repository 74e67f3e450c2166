#include "render/scene/material_source.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/io/volume_io.h"
#include "render/scene/solid.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;

/// Two cells along x: red scatters 1 and 3 per mm.
Material two_cells() {
  Material material{{2, 1, 1, 2.0, 2.0, 2.0}, 1.4, {}, "two"};
  for (auto& channel : material.channels) channel = {{0.01, 0.03}, {1.0, 3.0}};
  return material;
}

class MaterialFromAFile : public ::testing::Test {
 protected:
  TranslucentOptions options(const Material& material = two_cells()) {
    TranslucentOptions options;
    options.file = directory_.path() / "material.vdb";
    EXPECT_TRUE(write_material(system_files(), options.file, material, "test"));
    return options;
  }
  static double absorption(const TranslucentOptions& options, Vec3 place, const Pose& pose = {}) {
    const auto source = MaterialSource::create(options, pose);
    EXPECT_TRUE(source) << source.error().message;
    return source->at(place).absorption[0];
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(MaterialFromAFile, IsTrilinearBetweenCellCentresAndBringsItsIndex) {
  const TranslucentOptions two = options();
  EXPECT_NEAR(absorption(two, {1.0, 1.0, 1.0}), 0.01, 1e-8);
  EXPECT_NEAR(absorption(two, {2.0, 1.0, 1.0}), 0.02, 1e-8);
  EXPECT_NEAR(absorption(two, {2.5, 0.3, 1.9}), 0.025, 1e-8);
  const auto source = MaterialSource::create(two, {});
  EXPECT_EQ(source->ior(), 1.4);
  EXPECT_NEAR(source->at({3.0, 1.0, 1.0}).diffusion[1], 1.0 / (3.0 * 3.03), 1e-7);
}

TEST_F(MaterialFromAFile, GoesOnBeyondItsBlockByTiling) {
  TranslucentOptions two = options();
  two.tiling = Tiling::kClamp;
  EXPECT_NEAR(absorption(two, {100.0, 1.0, 1.0}), 0.03, 1e-8);
  two.tiling = Tiling::kMirror;  // 1 3 | 3 1 | 1 3
  EXPECT_NEAR(absorption(two, {7.0, 1.0, 1.0}), 0.01, 1e-8);
  EXPECT_NEAR(absorption(two, {-3.0, 1.0, 1.0}), 0.03, 1e-8);
  EXPECT_NEAR(absorption(two, {4.0, 1.0, 1.0}), 0.03, 1e-8);
  two.tiling = Tiling::kRepeat;  // 1 3 | 1 3
  EXPECT_NEAR(absorption(two, {5.0, 1.0, 1.0}), 0.01, 1e-8);
  EXPECT_NEAR(absorption(two, {4.0, 1.0, 1.0}), 0.02, 1e-8);
  EXPECT_NEAR(absorption(two, {-1.0, 1.0, 1.0}), 0.03, 1e-8);
}

TEST_F(MaterialFromAFile, MovesWithTheObjectAndScalesItsLengths) {
  TranslucentOptions two = options();
  two.origin = {-2.0, 0.0, 0.0};
  two.scale = 10.0;
  EXPECT_NEAR(absorption(two, {8.0, 5.0, 5.0}), 0.01, 1e-8);  // (8 + 2) / 10 = 1
  ShapeOptions turned;
  turned.rotation_degrees = {0.0, 0.0, 90.0};
  turned.position = {100.0, 0.0, 0.0};
  EXPECT_NEAR(absorption(two, {95.0, 28.0, 5.0}, scene_from_shape(turned)), 0.03, 1e-8);
}

TEST_F(MaterialFromAFile, IsRefusedWhereLightCannotDiffuse) {
  Material clear = two_cells();
  clear.channels[2].reduced_scattering[1] = 0.0;
  clear.channels[2].absorption[1] = 0.0;
  const auto source = MaterialSource::create(options(clear), {});
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("cell 1 neither scatters nor absorbs blue"));
}

TEST(Pattern, LayersAlternateAcrossZ) {
  TranslucentOptions options;
  options.pattern = {
      .kind = PatternOptions::Kind::kLayers, .size_mm = 5.0, .absorption = {0.2, 0.2, 0.2}};
  const auto source = MaterialSource::create(options, {});
  EXPECT_DOUBLE_EQ(source->at({0.0, 0.0, -1.0}).absorption[0], 0.01);
  EXPECT_DOUBLE_EQ(source->at({0.0, 0.0, 1.0}).absorption[0], 0.2);
  EXPECT_DOUBLE_EQ(source->at({0.0, 0.0, 6.0}).absorption[0], 0.01);
  EXPECT_FALSE(source->is_homogeneous());
}

TEST(Pattern, VeinsAreSmoothAndBetweenTheTwoSets) {
  TranslucentOptions options;
  options.pattern = {
      .kind = PatternOptions::Kind::kVeins, .size_mm = 4.0, .absorption = {0.2, 0.2, 0.2}};
  const auto source = MaterialSource::create(options, {});
  double lowest = 1.0;
  double highest = 0.0;
  double before = source->at({}).absorption[0];
  for (int k = 1; k < 40000; ++k) {
    const double now = source->at({0.001 * k, 0.0003 * k, -0.0004 * k}).absorption[0];
    // log 20 times 4 pi / 4 mm times the slope of place plus noise, about 1 + 1.6 x 3: 55 per mm. A jump is log 20 = 3.
    ASSERT_LT(std::abs(std::log(now / before)), 0.07);
    lowest = std::min(lowest, now);
    highest = std::max(highest, now);
    before = now;
  }
  EXPECT_GE(lowest, 0.01 * (1.0 - 1e-9));
  EXPECT_LT(lowest, 0.012);
  EXPECT_LE(highest, 0.2 * (1.0 + 1e-9));
  EXPECT_GT(highest, 0.1);
}

}  // namespace
}  // namespace opaline::render
