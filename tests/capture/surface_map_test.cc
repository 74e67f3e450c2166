#include "capture/surface_map.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace opaline::capture {
namespace {

using ::testing::HasSubstr;

const Block kBlock{12, 10, 3, 0.5, 0.6, 1.0};  // 6 x 6 x 3 mm
const Vec3 kMiddle{3.0, 3.0, 3.0};

CameraModel camera(double tilt_degrees, double distortion) {
  const double tilt = tilt_degrees * std::numbers::pi / 180.0;
  CameraModel model;
  model.width = 160;
  model.height = 140;
  model.fx = model.fy = 2000.0;
  model.cx = 80.0;
  model.cy = 70.0;
  model.distortion = {distortion, 0.0, 0.0, 0.0, 0.0};
  model.camera_from_sample = look_at(
      kMiddle + Vec3{std::sin(tilt), 0.0, std::cos(tilt)} * 120.0, kMiddle, {0.0, 1.0, 0.0});
  return model;
}

/// A picture of a field on the plane of the face, at pixel centres.
template <class Field>
HdrImage picture(const CameraModel& model, Field field) {
  HdrImage hdr{Image<float>(model.width, model.height, 3),
               Image<float>(model.width, model.height, 3, 1.0F),
               Image<std::uint8_t>(model.width, model.height, 1, 1),
               Image<std::uint8_t>(model.width, model.height, 1, 0)};
  const Vec3 eye = model.centre();
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      const Vec3 ray = model.ray_direction({x + 0.5, y + 0.5});
      const Vec3 hit = eye + ray * ((3.0 - eye.z) / ray.z);
      for (int c = 0; c < 3; ++c) hdr.radiance.at(x, y, c) = static_cast<float>(field(hit) + c);
    }
  }
  return hdr;
}

TEST(SurfaceMap, PutsALinearFieldIntoTheRightCells) {
  const CameraModel model = camera(25.0, -0.2);
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_TRUE(map) << map.error().message;
  const auto surface =
      map->apply(picture(model, [](Vec3 p) { return 0.3 * p.x - 0.2 * p.y; }), 0.5);
  for (int row = 1; row < 9; ++row) {
    for (int column = 1; column < 11; ++column) {
      const Vec3 centre = kBlock.face_cell_centre(Face::kZMax, column, row);
      ASSERT_EQ(surface.mask.at(column, row), 1);
      // Pixel values are taken at centres of whole pixels, 0.07 mm wide: their parts over the cell's
      // edge shift the mean by a small fraction of a pixel.
      EXPECT_NEAR(surface.radiance.at(column, row, 2), 2.0 + 0.3 * centre.x - 0.2 * centre.y, 2e-3);
    }
  }
}

/// A motion drawn from the covariance of independent ones.
CameraModel moved(CameraModel model,
                  const std::array<double, 6>& deviations,
                  std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::array<double, 6> m{};
  for (std::size_t k = 0; k < 6; ++k) m[k] = deviations[k] * normal(random);
  Pose& pose = model.camera_from_sample;
  const Pose was = pose;
  for (std::size_t column = 0; column < 3; ++column) {  // small: 1 + [w]x is a rotation
    const Vec3 axis{was.rotation[column], was.rotation[3 + column], was.rotation[6 + column]};
    const Vec3 turned = axis + cross({m[0], m[1], m[2]}, axis);
    pose.rotation[column] = turned.x;
    pose.rotation[3 + column] = turned.y;
    pose.rotation[6 + column] = turned.z;
  }
  pose.translation = was.translation + Vec3{m[3], m[4], m[5]};
  return model;
}

// Against pictures of cameras that truly stand elsewhere. The relative deviation of a mean of 200 squares is sqrt(2 / 200) = 10 %; four of them.
TEST(SurfaceMap, AnUnsurePlaceIsVarianceWhereTheLightChanges) {
  CameraModel model = camera(25.0, 0.0);
  model.width = model.height = 64;  // for speed
  model.fx = model.fy = 1000.0;
  model.cx = model.cy = 32.0;
  const std::array<double, 6> deviations{4e-4, 2e-4, 3e-4, 0.004, 0.002, 0.05};
  std::array<double, 36> covariance{};
  for (std::size_t k = 0; k < 6; ++k) covariance[7 * k] = deviations[k] * deviations[k];
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model, covariance);
  ASSERT_TRUE(map) << map.error().message;
  const auto field = [](Vec3 p) { return 0.3 * p.x - 0.2 * p.y; };
  const auto silent = [](HdrImage hdr) {
    std::ranges::fill(hdr.variance.samples(), 0.0f);
    return hdr;
  };
  const auto still = map->apply(silent(picture(model, field)), 0.5);
  std::mt19937_64 random(5);
  constexpr int kDraws = 200;
  std::array<double, 3> squares{};
  constexpr std::array<std::array<int, 2>, 3> kCells{{{2, 2}, {6, 5}, {10, 8}}};
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto other = map->apply(silent(picture(moved(model, deviations, random), field)), 0.5);
    for (std::size_t i = 0; i < kCells.size(); ++i) {
      const auto [column, row] = kCells[i];
      const double off = other.radiance.at(column, row, 0) - still.radiance.at(column, row, 0);
      squares[i] += off * off / kDraws;
    }
  }
  for (std::size_t i = 0; i < kCells.size(); ++i) {
    const auto [column, row] = kCells[i];
    EXPECT_NEAR(squares[i] / still.variance.at(column, row, 0), 1.0, 0.4) << i;
  }
  EXPECT_EQ(still.place_share, 1.0);
  const auto noisy = map->apply(picture(model, field), 0.5);
  EXPECT_GT(noisy.place_share, 0.0);
  EXPECT_LT(noisy.place_share, 1.0);
  EXPECT_EQ(
      SurfaceMap::create(kBlock, Face::kZMax, model)->apply(picture(model, field), 0.5).place_share,
      0.0);
}

TEST(SurfaceMap, AddsVariancesWithTheSquaredWeights) {
  const CameraModel model = camera(0.0, 0.0);  // 120 mm away: 16.7 pixels a mm
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_TRUE(map);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  double sum = 0.0;
  double predicted = 0.0;
  HdrImage hdr = picture(model, [](Vec3) { return 0.0; });
  for (int i = 0; i < 200; ++i) {
    for (float& sample : hdr.radiance.samples()) sample = static_cast<float>(normal(random));
    const auto surface = map->apply(hdr, 0.5);
    for (int column = 2; column < 10; ++column) {
      sum += std::pow(surface.radiance.at(column, 5, 0), 2);
      predicted += surface.variance.at(column, 5, 0);
    }
  }
  EXPECT_NEAR(sum / predicted, 1.0, 4.0 * std::sqrt(2.0 / 1600.0));  // 1600 squares of normals
}

TEST(SurfaceMap, LeavesOutPixelsThatReachOverTheFacesEdge) {
  const CameraModel model = camera(10.0, 0.0);
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_TRUE(map);
  // A picture that is wild outside the face: none of it may come in.
  const HdrImage hdr = picture(model, [](Vec3 p) {
    const bool inside = p.x >= 0.0 && p.x <= 6.0 && p.y >= 0.0 && p.y <= 6.0;
    return inside ? 1.0 : 1e6;
  });
  const auto surface = map->apply(hdr, 0.3);
  for (int row = 0; row < 10; ++row) {
    for (int column = 0; column < 12; ++column) {
      ASSERT_EQ(surface.mask.at(column, row), 1);
      EXPECT_FLOAT_EQ(surface.radiance.at(column, row, 0), 1.0F);
    }
  }
}

TEST(SurfaceMap, MasksCellsWithTooFewUsablePixels) {
  const CameraModel model = camera(0.0, 0.0);
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_TRUE(map);
  HdrImage hdr = picture(model, [](Vec3) { return 1.0; });
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      const Vec3 eye = model.centre();
      const Vec3 ray = model.ray_direction({x + 0.5, y + 0.5});
      if ((eye + ray * ((3.0 - eye.z) / ray.z)).x < 1.3) hdr.mask.at(x, y) = 0;  // 2.6 cells
    }
  }
  const auto surface = map->apply(hdr, 0.5);
  EXPECT_EQ(surface.mask.at(0, 5), 0);
  EXPECT_EQ(surface.mask.at(1, 5), 0);
  EXPECT_EQ(surface.mask.at(2, 5), 0);  // 40 % left
  EXPECT_EQ(surface.mask.at(3, 5), 1);
}

TEST(SurfaceMap, KnowsTheCosineToTheCamera) {
  const CameraModel model = camera(40.0, 0.0);
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_TRUE(map);
  const Vec3 to_camera = model.centre() - kBlock.face_cell_centre(Face::kZMax, 11, 0);
  EXPECT_NEAR(map->view().cosine.at(11, 0), to_camera.z / length(to_camera), 1e-6);
}

TEST(SurfaceMap, SeesEveryFaceFromItsOutside) {
  for (const Face face : kFaces) {
    const Vec3 centre{3.0, 3.0, 1.5};
    Vec3 outward{};
    (axis_of(face) == 0   ? outward.x
     : axis_of(face) == 1 ? outward.y
                          : outward.z) = is_max(face) ? 1.0 : -1.0;
    const Vec3 up = axis_of(face) == 1 ? Vec3{0.0, 0.0, 1.0} : Vec3{0.0, 1.0, 0.0};
    CameraModel model = camera(0.0, 0.0);
    model.camera_from_sample = look_at(centre + outward * 120.0, centre, up);
    const auto map = SurfaceMap::create(kBlock, face, model);
    ASSERT_TRUE(map) << to_string(face) << ": " << map.error().message;
    const Face behind = static_cast<Face>(static_cast<int>(face) ^ 1);
    EXPECT_FALSE(SurfaceMap::create(kBlock, behind, model));
  }
}

// Turned by half a turn about its own vertical, the face lies behind it, where Z < 0 mirrors it into
// the picture.
TEST(SurfaceMap, RefusesACameraThatLooksAway) {
  CameraModel model = camera(10.0, 0.0);
  for (const int row : {0, 2}) {
    for (int i = 0; i < 3; ++i) model.camera_from_sample.rotation[3 * row + i] *= -1.0;
  }
  model.camera_from_sample.translation.x *= -1.0;
  model.camera_from_sample.translation.z *= -1.0;
  EXPECT_LT(length(model.centre() - camera(10.0, 0.0).centre()), 1e-9);
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(map.error().message, HasSubstr("looks away"));
}

TEST(SurfaceMap, SaysWhenTheCameraLooksPast) {
  CameraModel model = camera(0.0, 0.0);
  model.cx = 5000.0;
  const auto map = SurfaceMap::create(kBlock, Face::kZMax, model);
  ASSERT_FALSE(map);
  EXPECT_THAT(map.error().message, HasSubstr("sees nothing"));
}

}  // namespace
}  // namespace opaline::capture
