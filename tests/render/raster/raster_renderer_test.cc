#include "render/raster/raster_renderer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <mutex>

#include "base/io/surface_io.h"
#include "base/io/volume_io.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A ring over a floor, lit from one side.
Scene ring_on_floor() {
  Scene scene;
  scene.picture = {.width = 160, .height = 120, .samples_per_axis = 1};
  scene.camera.position = {34.0, -40.0, 32.0};
  scene.camera.target = {0.0, 0.0, -1.0};
  scene.camera.field_of_view_degrees = 34.0;
  scene.diffusion.tetrahedra = 1e4;
  ObjectOptions ring;
  ring.name = "ring";
  ring.shape.name = "torus";
  ring.shape.size_mm = 30.0;
  ring.shape.rotation_degrees = {12.0, 0.0, 0.0};
  ObjectOptions floor;
  floor.name = "floor";
  floor.kind = ObjectOptions::Kind::kOpaque;
  floor.shape.name = "plane";
  floor.shape.size_mm = 80.0;
  floor.shape.position.z = -7.0;
  floor.opaque_ior = 1.4;
  scene.objects = {ring, floor};
  scene.lights = {{.name = "sun", .direction = {-0.5, -1.0, -0.9}}};
  return scene;
}

class Raster : public ::testing::Test {
 protected:
  void make(const Scene& scene) {
    scene_ = scene;
    auto made = SceneRenderer::create(scene, team_, [](std::string_view, double) {}, {});
    ASSERT_TRUE(made) << made.error().message;
    host_ = *std::move(made);
    ASSERT_TRUE(host_->light(scene.lights, {}));
    RasterOptions options;
    options.gpu.validation = true;
    options.gpu.on_validation_message = [this](std::string_view message) {
      const std::lock_guard lock(mutex_);
      said_.emplace_back(message);
    };
    auto raster = RasterRenderer::create(options);
    ASSERT_TRUE(raster) << raster.error().message;
    raster_ = *std::move(raster);
    const auto taken = raster_->take(*host_);
    ASSERT_TRUE(taken) << taken.error().message;
  }
  CameraModel camera() const { return camera_of(scene_.camera, scene_.picture); }
  Image<float> by_host() { return *host_->draw(camera(), {}); }
  Image<float> by_raster(int samples = 1) {
    auto picture = raster_->draw(camera(), samples, {});
    EXPECT_TRUE(picture) << picture.error().message;
    return *std::move(picture);
  }
  void TearDown() override {
    raster_.reset();
    EXPECT_THAT(said_, IsEmpty());
  }

  /// The share of pixels that differ by more than 2 % of the picture's mean radiance.
  static double share_that_differs(const Image<float>& a, const Image<float>& b) {
    double mean = 0.0;
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) mean += b.at(x, y, 1);
    }
    mean /= static_cast<double>(a.pixel_count());
    int differ = 0;
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) {
        double most = 0.0;
        for (int c = 0; c < 3; ++c) {
          most = std::max<double>(most, std::abs(a.at(x, y, c) - b.at(x, y, c)));
        }
        if (most > 0.02 * mean) ++differ;
      }
    }
    return static_cast<double>(differ) / static_cast<double>(a.pixel_count());
  }

  ThreadTeam team_{2};
  Scene scene_;
  std::unique_ptr<SceneRenderer> host_;
  std::mutex mutex_;
  std::vector<std::string> said_;
  std::unique_ptr<RasterRenderer> raster_;
};

// One ray a pixel and one sample a pixel see the same point of the same triangles. What is left: outlines, a pixel or less wide
// (here 900 of 19200 pixels lie on one), and the rims of shadows, of which a texel is 0.03 mm.
TEST_F(Raster, ShowsWhatRaysShow) {
  make(ring_on_floor());
  EXPECT_LT(share_that_differs(by_raster(), by_host()), 0.01);
}

TEST_F(Raster, ShowsSpotsAndPointLightsAsRaysDo) {
  Scene scene = ring_on_floor();
  scene.objects[0].surface.specular = SpecularModel::kWard;
  LightOptions lamp{.name = "lamp", .kind = LightOptions::Kind::kPoint};
  lamp.position = {60.0, 40.0, 90.0};
  lamp.intensity = {4e3, 3e3, 2e3};
  LightOptions spot = lamp;
  spot.kind = LightOptions::Kind::kSpot;
  spot.position = {-60.0, -20.0, 60.0};
  spot.direction = {60.0, 20.0, -64.0};
  spot.cone_degrees = 12.0;
  spot.blur_degrees = 3.0;
  scene.lights = {lamp, spot};
  make(scene);
  EXPECT_THAT(raster_->left_out(), IsEmpty());
  EXPECT_LT(share_that_differs(by_raster(), by_host()), 0.015);
}

TEST_F(Raster, ShowsAMeasuredSurfaceAsRaysDo) {
  const testing::TemporaryDirectory directory;
  Material material;
  SurfaceReflectance surface;
  material.block = surface.block = {6, 6, 2, 1.0, 1.0, 1.0};
  for (auto& channel : material.channels) {
    channel.absorption.assign(material.block.cell_count(), 0.01);
    channel.reduced_scattering.assign(material.block.cell_count(), 1.0);
  }
  surface.reflectance = surface.variance = Image<float>(6, 6, 3);
  surface.mask = Image<std::uint8_t>(6, 6, 1);
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      surface.mask.at(x, y) = 1;
      surface.reflectance.at(x, y, 0) = 0.02F * static_cast<float>(x);
      surface.reflectance.at(x, y, 1) = 0.02F * static_cast<float>(y);
    }
  }
  Scene scene = ring_on_floor();
  scene.environment = {.radiance = {0.2, 0.2, 0.2}, .rays = 0};
  for (ObjectOptions& object : scene.objects) object.surface.specular = SpecularModel::kNone;
  TranslucentOptions& made_of = scene.objects[0].material;
  made_of.file = directory.path() / "material.vdb";
  made_of.placement = Placement::kShell;
  ASSERT_TRUE(write_material(system_files(), made_of.file, material, "test"));
  make(scene);
  const auto without = by_raster();
  scene.objects[0].material.surface_reflectance = directory.path() / "surface.exr";
  ASSERT_TRUE(
      write_surface(system_files(), scene.objects[0].material.surface_reflectance, surface));
  make(scene);
  const auto with = by_raster();
  EXPECT_GT(share_that_differs(with, without), 0.05);
  EXPECT_LT(share_that_differs(with, by_host()), 0.01);
}

// From below the floor hides half of the ring and shows its back, which is as bright as its front.
TEST_F(Raster, ShowsTheBackOfAFloorAsRaysDo) {
  Scene scene = ring_on_floor();
  scene.camera.position.z = -40.0;
  scene.lights[0].direction = {-0.5, -1.0, 0.9};
  make(scene);
  EXPECT_LT(share_that_differs(by_raster(), by_host()), 0.01);
  scene.lights[0].direction.z *= 1.5;  // only light and lamps change: surfaces are not sent again
  ASSERT_TRUE(host_->light(scene.lights, {}));
  ASSERT_TRUE(raster_->take(*host_));
  EXPECT_LT(share_that_differs(by_raster(), by_host()), 0.01);
}

TEST_F(Raster, ASceneWithoutAShadowDiffersWhereTheShadowWas) {
  Scene scene = ring_on_floor();
  scene.lights[0].shadows = false;
  make(scene);
  const auto without = by_raster();
  scene.lights[0].shadows = true;
  make(scene);
  EXPECT_GT(share_that_differs(by_raster(), without), 0.05);
}

TEST_F(Raster, SamplesAverageToThePixel) {
  make(ring_on_floor());
  scene_.picture.samples_per_axis = 3;
  const auto fine = by_raster(3);
  const auto coarse = by_raster(1);
  for (int y = 0; y < fine.height(); ++y) {
    for (int x = 0; x < fine.width(); ++x) {
      ASSERT_GE(fine.at(x, y, 3), 0.0F);
      ASSERT_LE(fine.at(x, y, 3), 1.0F);
    }
  }
  EXPECT_LT(share_that_differs(coarse, fine), 0.15);
  EXPECT_GT(share_that_differs(coarse, fine), 0.001);
}

TEST_F(Raster, ALightAmidTheSceneCastsNoShadowAndSaysSo) {
  Scene scene = ring_on_floor();
  LightOptions lamp{.name = "lamp", .kind = LightOptions::Kind::kPoint};
  lamp.position = {0.0, 0.0, 10.0};
  scene.lights = {lamp};
  make(scene);
  EXPECT_THAT(raster_->left_out(), ElementsAre(HasSubstr("shadows of lamp: it stands within")));
}

TEST_F(Raster, DisplaysTheSamePictureInEightBits) {
  make(ring_on_floor());
  const auto radiance = by_raster();
  const auto shown = raster_->display(camera(), {.background = {0.2, 0.2, 0.2}, .gain = 2.0});
  ASSERT_TRUE(shown) << shown.error().message;
  for (int y = 3; y < 120; y += 7) {
    for (int x = 3; x < 160; x += 7) {
      const double a = radiance.at(x, y, 3);
      const double value =
          std::min(1.0, std::min<double>(2.0 * radiance.at(x, y, 0), a) + 0.2 * (1.0 - a));
      const double code =
          value > 0.0031308 ? 1.055 * std::pow(value, 1 / 2.4) - 0.055 : 12.92 * value;
      ASSERT_NEAR(shown->at(x, y, 0), 255.0 * code, 1.0) << x << ' ' << y;
      ASSERT_EQ(shown->at(x, y, 3), 255);
    }
  }
}

TEST_F(Raster, AbsentDeviceIsRefusedWithAReason) {
  RasterOptions options;
  options.gpu.device.name = "no such device";
  const auto made = RasterRenderer::create(options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::kUnavailable);
}

TEST_F(Raster, ALostDeviceIsAnErrorAndAnotherOneGoesOn) {
  make(ring_on_floor());
  RasterOptions options;
  options.gpu.rehearsal.lost_at_submission = 2;  // the first takes the scene
  auto fragile = RasterRenderer::create(options);
  ASSERT_TRUE(fragile);
  Result<void> taken = (*fragile)->take(*host_);
  Result<Image<float>> drawn =
      taken ? (*fragile)->draw(camera(), 1, {}) : Result<Image<float>>(taken.error());
  ASSERT_FALSE(drawn);
  EXPECT_EQ(drawn.error().code, ErrorCode::kUnavailable);
  EXPECT_LT(share_that_differs(by_raster(), by_host()), 0.01);
}

}  // namespace
}  // namespace opaline::render
