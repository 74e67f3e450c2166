#include "render/renderer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/render/ray_caster.h"
#include "tests/support/vulkan.h"

namespace opaline::render {
namespace {

using testing::HasSubstr;

const Block kBlock{24, 20, 6, 1.0, 1.25, 0.8};

/// Smooth light that differs on every face and in every channel, phi_s and J_n positive.
SurfaceField smooth_field(const Block& block = kBlock, double ior = 1.3) {
  SurfaceField field{block, ior, {}};
  for (const Face face : kFaces) {
    const int n = static_cast<int>(face);
    Image<float> fluence(block.face_width(face), block.face_height(face), 3);
    Image<float> flux = fluence;
    for (int y = 0; y < fluence.height(); ++y)
      for (int x = 0; x < fluence.width(); ++x)
        for (int c = 0; c < 3; ++c) {
          const double wave = std::sin(0.3 * x + n) * std::cos(0.4 * y + c);
          fluence.at(x, y, c) = static_cast<float>(2.0 + n + wave);
          flux.at(x, y, c) = static_cast<float>(0.3 + 0.1 * c + 0.2 * wave);
        }
    field.faces[n] = {fluence, flux};
  }
  return field;
}

/// A camera at `from` that looks at `at`, its picture's y axis as near to the sample's -y as can
/// be.
CameraModel look(Vec3 from, Vec3 at, int width = 120, int height = 90) {
  const Vec3 z = normalized(at - from);
  const Vec3 up = std::abs(z.y) < 0.9 ? Vec3{0, -1, 0} : Vec3{1, 0, 0};
  const Vec3 y = normalized(up - z * dot(up, z));
  const Vec3 x = cross(y, z);
  CameraModel camera{width, height, 300.0, 310.0, 0.5 * width + 3.0, 0.5 * height - 2.0, {}, {}};
  camera.camera_from_sample.rotation = {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
  camera.camera_from_sample.translation = camera.camera_from_sample.rotate(from) * -1.0;
  return camera;
}
const Vec3 kMiddle = kBlock.size() * 0.5;

class RendererTest : public testing::Test {
 protected:
  void SetUp() override {
    auto renderer = Renderer::create({tests::validated(), 2});
    ASSERT_TRUE(renderer) << renderer.error().message;
    renderer_ = *std::move(renderer);
    auto host = Renderer::create({.gpu = {}, .samples_per_axis = 2, .host_threads = 2});
    ASSERT_TRUE(host) << host.error().message;
    host_ = *std::move(host);
  }
  Image<float> draw(const SurfaceField& field, const CameraModel& camera) {
    auto picture = renderer_->draw(field, camera, {});
    EXPECT_TRUE(picture) << picture.error().message;
    return picture ? *std::move(picture) : Image<float>(camera.width, camera.height, 4);
  }
  /// Radiances agree to 1e-4 (float32 against float64: rays meet the face within 1e-4 of a cell).
  /// Where a ray passes an edge within rounding it may fall on either side: that is allowed for two
  /// pixels.
  void expect_as_ray_cast(const SurfaceField& field, const CameraModel& camera) {
    expect_as_ray_cast(field, camera, draw(field, camera));
    const auto on_host = host_->draw(field, camera, {});
    ASSERT_TRUE(on_host) << on_host.error().message;
    expect_as_ray_cast(field, camera, *on_host);
  }
  static void expect_as_ray_cast(const SurfaceField& field,
                                 const CameraModel& camera,
                                 const Image<float>& drawn) {
    const Image<float> cast = tests::RayCaster(field, camera).draw(2);
    int covered = 0;
    int different = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        covered += cast.at(x, y, 3) == 1.0F;
        bool same = drawn.at(x, y, 3) == cast.at(x, y, 3);
        for (int c = 0; c < 3; ++c)
          same &= std::abs(drawn.at(x, y, c) - cast.at(x, y, c)) <= 1e-4F * cast.at(x, y, c);
        different += !same;
      }
    EXPECT_GT(covered, camera.width * camera.height / 10);
    EXPECT_LE(different, 2);
  }
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<Renderer> host_;
};

TEST_F(RendererTest, AgreesWithARayCasterStraightOn) {
  expect_as_ray_cast(smooth_field(), look(kMiddle + Vec3{0, 0, 80}, kMiddle));
}

TEST_F(RendererTest, AgreesWithARayCasterOnThreeFacesAtOnce) {
  expect_as_ray_cast(smooth_field(), look(kMiddle + Vec3{50, 40, 45}, kMiddle));
  expect_as_ray_cast(smooth_field(), look(kMiddle + Vec3{-45, -50, -40}, kMiddle));
}

TEST_F(RendererTest, AgreesWithARayCasterThroughADistortedLens) {
  CameraModel camera = look(kMiddle + Vec3{20, 15, 55}, kMiddle);
  camera.distortion = {-0.28, 0.11, 0.002, -0.0015, 0.01};
  expect_as_ray_cast(smooth_field(), camera);
}

TEST_F(RendererTest, AgreesWithARayCasterWhenTheBlockFillsMoreThanThePicture) {
  CameraModel camera = look(kMiddle + Vec3{4, -3, 14}, kMiddle);
  camera.distortion = {-0.2, 0.05, 0.0, 0.0, 0.0};
  expect_as_ray_cast(smooth_field(), camera);
}

TEST_F(RendererTest, AgreesWithARayCasterAtEtaOneAndThree) {
  for (const double eta : {1.0, 3.0})
    expect_as_ray_cast(smooth_field(kBlock, eta), look(kMiddle + Vec3{30, 30, 60}, kMiddle));
}

TEST_F(RendererTest, AgreesWithARayCasterInAPictureOfSeveralTiles) {
  expect_as_ray_cast(smooth_field(), look(kMiddle + Vec3{2, 3, 40}, kMiddle, 700, 520));
}

TEST_F(RendererTest, DrawsASingleCell) {
  const Block one{1, 1, 1, 10.0, 10.0, 10.0};
  expect_as_ray_cast(smooth_field(one), look({40, 30, 35}, {5, 5, 5}));
}

TEST_F(RendererTest, ShowsTheRightCellInTheRightPlace) {
  SurfaceField field = smooth_field();
  for (FaceField& face : field.faces) {
    face.fluence = Image<float>(face.fluence.width(), face.fluence.height(), 3);
    face.net_flux = face.fluence;
  }
  const int column = 19;
  const int row = 4;
  FaceField& top = field.faces[static_cast<std::size_t>(Face::kZMax)];
  top.fluence.at(column, row, 1) = 1.0F;  // a green dot, off the middle both ways
  const CameraModel camera = look(kMiddle + Vec3{5, 8, 70}, kMiddle);
  const Image<float> picture = draw(field, camera);
  const auto seen = camera.project(kBlock.face_cell_centre(Face::kZMax, column, row));
  const int x = static_cast<int>(seen.x);
  const int y = static_cast<int>(seen.y);
  const double most = *std::ranges::max_element(picture.samples().begin(), picture.samples().end());
  EXPECT_EQ(most, 1.0);  // coverage
  EXPECT_GT(picture.at(x, y, 1), 0.03);
  EXPECT_EQ(picture.at(x, y, 0), 0.0F);
  for (int py = 0; py < camera.height; ++py)
    for (int px = 0; px < camera.width; ++px) {
      const bool far_off = std::hypot(px - x, py - y) > 10;
      ASSERT_FALSE(far_off && picture.at(px, py, 1) != 0.0F) << px << " " << py;
    }
}

// From straight above only the top shows, so that every pixel gains its coverage times the reflected radiance.
TEST_F(RendererTest, AddsWhatTheSurfaceReflects) {
  const CameraModel camera = look(kMiddle + Vec3{0.3, 0.2, 120}, kMiddle);
  SurfaceField field = smooth_field();
  const Image<float> before = draw(field, camera);
  FaceField& top = field.faces[static_cast<std::size_t>(Face::kZMax)];
  top.reflected = Image<float>(top.fluence.width(), top.fluence.height(), 3, 0.5F);
  const Image<float> after = draw(field, camera);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(after.at(x, y, c) - before.at(x, y, c), 0.5F * after.at(x, y, 3), 1e-5F);
  const auto on_host = host_->draw(field, camera, {});
  ASSERT_TRUE(on_host);
  for (std::size_t i = 0; i < on_host->samples().size(); ++i) {
    ASSERT_NEAR(on_host->samples()[i], after.samples()[i], 1e-4F * (1.0F + after.samples()[i]));
  }
  top.reflected = Image<float>(1, 1, 3);
  EXPECT_FALSE(renderer_->draw(field, camera, {}));
}

TEST_F(RendererTest, LeavesTheBackgroundBlackAndCoversEdgesInPart) {
  const CameraModel camera = look(kMiddle + Vec3{0.3, 0.2, 120}, kMiddle);
  const Image<float> picture = draw(smooth_field(), camera);
  for (int c = 0; c < 4; ++c) EXPECT_EQ(picture.at(0, 0, c), 0.0F);
  EXPECT_EQ(picture.at(camera.width / 2, camera.height / 2, 3), 1.0F);
  const auto partly = [](float v) { return v == 0.25F || v == 0.5F || v == 0.75F; };
  EXPECT_TRUE(std::ranges::any_of(picture.samples(), partly));
}

TEST_F(RendererTest, ConservesTheExitanceThatLeavesTowardsAllDirections) {
  // int L mu_o domega = M for an unlit face when A has both moments (docs/physics.md), A = 2.34053
  // at eta = 1.3: radiance along mu_o is read off pictures of a far, small block, and integrated by
  // Simpson's rule in mu_o^2.
  SurfaceField field = smooth_field();
  for (FaceField& face : field.faces) {
    std::ranges::fill(face.net_flux.samples(), 1.0F);
    std::ranges::fill(face.fluence.samples(), static_cast<float>(2.0 * 2.34053));
  }
  double integral = 0.0;
  const int n = 40;
  for (int i = 0; i <= n; ++i) {
    const double mu = std::sqrt(std::max(static_cast<double>(i) / n, 1e-4));
    const Vec3 from{1e4 * std::sqrt(1.0 - mu * mu), 0, 1e4 * mu};
    CameraModel camera = look(kMiddle + Vec3{0, 0, 0.5 * kBlock.size().z} + from,
                              kMiddle + Vec3{0, 0, 0.5 * kBlock.size().z},
                              3,
                              3);
    camera.fx = camera.fy = 1e8;  // far into the face's middle
    camera.cx = camera.cy = 1.5;
    const double weight = i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    integral += weight * std::numbers::pi / (3.0 * n) * draw(field, camera).at(1, 1, 0);
  }
  EXPECT_NEAR(integral, 1.0, 2e-3);  // Simpson's error at the grazing end
}

TEST_F(RendererTest, RefusesACameraInsideTheBlockOrLookingAway) {
  const SurfaceField field = smooth_field();
  const auto inside = renderer_->draw(field, look(kMiddle, kMiddle + Vec3{0, 0, 1}), {});
  ASSERT_FALSE(inside);
  EXPECT_EQ(inside.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(inside.error().message, HasSubstr("inside the sample"));
  const Vec3 away = kMiddle + Vec3{0, 0, 50};
  const auto behind = renderer_->draw(field, look(away, away + Vec3{0, 0, 1}), {});
  ASSERT_FALSE(behind);
  EXPECT_EQ(behind.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(behind.error().message, HasSubstr("in front of the camera"));
}

TEST_F(RendererTest, NamesTheFaceWhoseFieldHasTheWrongShape) {
  SurfaceField field = smooth_field();
  field.faces[2].net_flux = Image<float>(1, 1, 3);
  const auto refused = renderer_->draw(field, look({0, 0, 90}, kMiddle), {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("face y_min: net flux"));
}

TEST_F(RendererTest, RefusesNumbersThatAreNone) {
  SurfaceField field = smooth_field();
  field.faces[5].fluence.at(3, 3, 1) = std::nanf("");
  EXPECT_FALSE(renderer_->draw(field, look({0, 0, 90}, kMiddle), {}));
  CameraModel camera = look(kMiddle + Vec3{0, 0, 80}, kMiddle);
  camera.fx = 0.0;
  EXPECT_FALSE(renderer_->draw(smooth_field(), camera, {}));
  camera = look(kMiddle + Vec3{0, 0, 80}, kMiddle);
  camera.camera_from_sample.rotation[0] = 2.0;
  EXPECT_FALSE(renderer_->draw(smooth_field(), camera, {}));
}

TEST_F(RendererTest, WithoutADeviceItIsDrawnOnTheHostAllTheSame) {
  RendererOptions nowhere;
  nowhere.gpu.device.name = "no such device";
  EXPECT_EQ(Renderer::create(nowhere).error().code, ErrorCode::kUnavailable);
  const auto host = Renderer::create_or_host(nowhere, 2);
  ASSERT_TRUE(host) << host.error().message;
  EXPECT_THAT((*host)->description(), HasSubstr("host"));
  const SurfaceField field = smooth_field();
  const CameraModel camera = look(kMiddle + Vec3{50, 40, 45}, kMiddle);
  const auto picture = (*host)->draw(field, camera, {});
  ASSERT_TRUE(picture) << picture.error().message;
  expect_as_ray_cast(field, camera, *picture);
  EXPECT_FALSE((*host)->draw(field, look(kMiddle, kMiddle + Vec3{0, 0, 1}), {}));
}

TEST_F(RendererTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  const auto stopped =
      renderer_->draw(smooth_field(), look(kMiddle + Vec3{0, 0, 80}, kMiddle), source.get_token());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::render
