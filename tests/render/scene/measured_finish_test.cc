#include "render/scene/measured_finish.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "base/io/surface_io.h"
#include "base/io/volume_io.h"
#include "render/scene/scene_renderer.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;

constexpr Block kBlock{8, 6, 4, 0.5, 0.5, 0.5};

class Finish : public ::testing::Test {
 protected:
  /// A file of what the block's z_max face reflects, by column and row.
  template <class Reflectance>
  TranslucentOptions measured(const Reflectance& reflectance, double masked_from_column = 8.0) {
    SurfaceReflectance s;
    s.block = kBlock;
    s.reflectance = Image<float>(kBlock.nx, kBlock.ny, 3);
    s.variance = s.reflectance;
    s.mask = Image<std::uint8_t>(kBlock.nx, kBlock.ny, 1);
    for (int y = 0; y < kBlock.ny; ++y) {
      for (int x = 0; x < kBlock.nx; ++x) {
        s.mask.at(x, y) = x < masked_from_column ? 1 : 0;
        for (int c = 0; c < 3 && s.mask.at(x, y) != 0; ++c) {
          s.reflectance.at(x, y, c) = static_cast<float>((c + 1) * reflectance(x, y));
        }
      }
    }
    TranslucentOptions options;
    options.surface_reflectance = directory_.path() / "surface_reflectance.exr";
    EXPECT_TRUE(write_surface(system_files(), options.surface_reflectance, s));
    return options;
  }
  /// The same material everywhere, as a file.
  std::filesystem::path plain_material() {
    Material material;
    material.block = kBlock;
    for (auto& channel : material.channels) {
      channel.absorption.assign(kBlock.cell_count(), 0.01);
      channel.reduced_scattering.assign(kBlock.cell_count(), 1.0);
    }
    const auto file = directory_.path() / "material.vdb";
    EXPECT_TRUE(write_material(system_files(), file, material, "test"));
    return file;
  }
  static MeasuredFinish read(const TranslucentOptions& options) {
    auto finish = MeasuredFinish::create(options);
    EXPECT_TRUE(finish) << finish.error().message;
    return *std::move(finish);
  }
  testing::TemporaryDirectory directory_;
};

// rho_s = 0.02 / mm along x, linear between the cells' middles.
TEST_F(Finish, LiesOnACutShapeAsItsBlockDoes) {
  TranslucentOptions options = measured([](int x, int) { return 0.01 * (x + 0.5); });
  EXPECT_NEAR(read(options).at({1.1, 2.0, 0.3}, {0.0, 0.0, 1.0})[0], 0.022, 1e-6);
  EXPECT_NEAR(read(options).at({1.1, 0.7, 9.0}, {1.0, 0.0, 0.0})[2], 0.066, 1e-6);
  options.origin = {-1.0, 0.0, 0.0};
  options.scale = 2.0;
  EXPECT_NEAR(read(options).at({1.1, 2.0, 0.3}, {0.0, 0.0, 1.0})[0], 0.021, 1e-6);
  options.tiling = Tiling::kRepeat;  // 4 mm, twice as large
  EXPECT_NEAR(read(options).at({9.1, 2.0, 0.3}, {0.0, 0.0, 1.0})[0], 0.021, 1e-6);
}

// Each axis sees the face's columns along another axis: y, z, x.
TEST_F(Finish, LiesAroundAShapeAsEachAxisSeesIt) {
  TranslucentOptions options = measured([](int x, int) { return 0.01 * (x + 0.5); });
  options.placement = Placement::kShell;
  const MeasuredFinish finish = read(options);
  const Vec3 p{0.6, 1.2, 2.4};
  EXPECT_NEAR(finish.at(p, {-1.0, 0.0, 0.0})[0], 0.024, 1e-6);
  EXPECT_NEAR(finish.at(p, {0.0, 1.0, 0.0})[0], 0.048, 1e-6);
  EXPECT_NEAR(finish.at(p, {0.0, 0.0, 1.0})[0], 0.012, 1e-6);
  EXPECT_NEAR(
      finish.at(p, {0.6, 0.8, 0.0})[0],
      (std::pow(0.6, 4) * 0.024 + std::pow(0.8, 4) * 0.048) / (std::pow(0.6, 4) + std::pow(0.8, 4)),
      1e-6);
}

TEST_F(Finish, TakesTheCellsThatWereMeasured) {
  const auto options = measured([](int x, int) { return x < 2 ? 0.02 : 0.04; }, 4.0);
  const MeasuredFinish finish = read(options);
  EXPECT_NEAR(finish.at({2.0, 1.0, 0.0}, {0.0, 0.0, 1.0})[0], 0.04, 1e-6);  // half a cell beyond
  EXPECT_NEAR(finish.at({3.5, 1.0, 0.0}, {0.0, 0.0, 1.0})[0], 0.03, 1e-6);  // none near: the mean
}

TEST_F(Finish, IsBlackWhereNoiseMadeItNegative) {
  const auto options = measured([](int x, int) { return x == 0 ? -0.5 : 0.01; });
  EXPECT_EQ(read(options).at({0.25, 1.0, 0.0}, {0.0, 0.0, 1.0})[1], 0.0);
}

TEST_F(Finish, IsRefusedWhereNothingWasMeasured) {
  const auto nothing = MeasuredFinish::create(measured([](int, int) { return 0.01; }, 0.0));
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(nothing.error().message, HasSubstr("no cell of it was measured"));
  TranslucentOptions missing;
  missing.surface_reflectance = directory_.path() / "none.exr";
  EXPECT_FALSE(MeasuredFinish::create(missing));
}

// What a picture of a sphere has more with than without is rho_s E (n.l) + pi rho_s L_env at each of its places, and nothing else: light
// and camera on one side, so nothing is in shadow where it is seen, and half of it is dark.
TEST_F(Finish, AddsItsLightToAPicture) {
  constexpr double kReflectance = 0.05;  // 1/sr
  Scene scene;
  scene.picture = {.width = 64, .height = 64, .samples_per_axis = 1};
  scene.camera.position = {0.0, -50.0, 0.0};
  scene.camera.field_of_view_degrees = 26.0;
  scene.diffusion.tetrahedra = 5e3;
  scene.environment.radiance = {0.1, 0.1, 0.1};
  scene.environment.rays = 0;
  ObjectOptions ball;
  ball.shape.name = "sphere";
  ball.shape.size_mm = 20.0;
  ball.material = measured([](int, int) { return kReflectance; });
  ball.material.file = plain_material();
  ball.surface.specular = SpecularModel::kNone;
  scene.objects = {ball};
  scene.lights = {{.direction = {-1.0, 1.0, 0.0}}};
  scene.lights[0].irradiance = {2.0, 2.0, 2.0};
  const auto drawn = [&scene] {
    ThreadTeam team(2);
    auto renderer = SceneRenderer::create(scene, team, [](std::string_view, double) {}, {});
    EXPECT_TRUE(renderer) << renderer.error().message;
    EXPECT_TRUE((*renderer)->light(scene.lights, {}));
    return *(*renderer)->draw(camera_of(scene.camera, scene.picture), {});
  };
  const Image<float> with = drawn();
  scene.objects[0].material.surface_reflectance.clear();
  const Image<float> without = drawn();
  const CameraModel camera = camera_of(scene.camera, scene.picture);
  const Vec3 to_light = normalized({1.0, -1.0, 0.0});
  double error = 0.0;
  double size = 0.0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 o = camera.centre();
      const Vec3 d = normalized(camera.ray_direction({x + 0.5, y + 0.5}));
      const double nearest = -dot(o, d);
      const double square = 100.0 - dot(o, o) + nearest * nearest;
      if (square < 1.0 || with.at(x, y, 3) < 1.0F) continue;
      const Vec3 normal = (o + d * (nearest - std::sqrt(square))) * 0.1;
      const double truth =
          kReflectance * (2.0 * std::max(0.0, dot(normal, to_light)) + std::numbers::pi * 0.1);
      for (int c = 0; c < 3; ++c) {
        error += std::pow(with.at(x, y, c) - without.at(x, y, c) - (c + 1) * truth, 2);
        size += std::pow((c + 1) * truth, 2);
      }
    }
  }
  ASSERT_GT(size, 0.0);
  EXPECT_LT(std::sqrt(error / size),
            0.02);  // facets of a twelfth of the radius: normals off by less
}

}  // namespace
}  // namespace opaline::render
