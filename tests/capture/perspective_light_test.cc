// Which pixels of a projector that stands beside the camera light what, against closed forms.

#include <gmock/gmock.h>

#include <cmath>

#include "capture/face_light.h"
#include "capture/patterns.h"

namespace opaline::capture {
namespace {

using ::testing::HasSubstr;

const Block kBlock{48, 48, 24, 0.5, 0.5, 0.5};

ProjectorCalibration projector_at(Vec3 centre) {
  ProjectorCalibration p;
  p.kind = ProjectorKind::kPerspective;
  p.lens = {.width = 640,
            .height = 480,
            .fx = 3300.0,
            .fy = 3310.0,
            .cx = 325.0,
            .cy = 236.0,
            .camera_from_sample = look_at(centre, {12.0, 12.0, 12.0}, {0.0, 1.0, 0.0})};
  p.reference_distance_mm = 280.0;
  p.peak_irradiance = {1e-3, 2e-3, 3e-3};
  p.black_level = 0.0;
  return p;
}

double power_on(const Image<float>& irradiance, int channel) {
  double sum = 0.0;
  for (int y = 0; y < irradiance.height(); ++y) {
    for (int x = 0; x < irradiance.width(); ++x) sum += irradiance.at(x, y, channel);
  }
  return sum * kBlock.hx * kBlock.hy;
}

TEST(PerspectiveLight, FallsOffWithTheSquareOfTheDistanceAndTheCosine) {
  const ProjectorCalibration p = projector_at({42.0, -20.0, 300.0});
  const Image<float> e =
      irradiance_of(Image<std::uint8_t>(640, 480, 3, 255), kBlock, Face::kZMax, p);
  for (const auto& [column, row] : {std::pair{0, 0}, {24, 24}, {47, 0}, {3, 47}}) {
    const Vec3 way = p.lens.centre() - Vec3{(column + 0.5) * 0.5, (row + 0.5) * 0.5, 12.0};
    const double d2 = dot(way, way);
    const double expected = 1e-3 * 280.0 * 280.0 / d2 * way.z / std::sqrt(d2);
    EXPECT_NEAR(e.at(column, row, 0), expected, 1e-6 * expected);
    EXPECT_NEAR(e.at(column, row, 2), 3.0 * expected, 3e-6 * expected);
  }
}

// A pixel of a distant lens sends I dOmega, I = peak reference^2 and dOmega = cos^3 / (fx fy), wherever it falls: what arrives on the face is
// what its lit pixels send. The irradiance is taken at the cells' middles: 1e-4.
TEST(PerspectiveLight, BringsAllThatItsPixelsSend) {
  ProjectorCalibration p = projector_at({90.0, 30.0, 290.0});
  p.vignetting = {{-0.2, 0.0, 0.0}};
  Image<std::uint8_t> codes(640, 480, 3);
  double sent = 0.0;
  for (int y = 200; y < 300; ++y) {
    for (int x = 260; x < 400; ++x) {
      codes.at(x, y, 1) = 255;
      const double u = (x + 0.5 - p.lens.cx) / p.lens.fx;
      const double v = (y + 0.5 - p.lens.cy) / p.lens.fy;
      const double dx = x + 0.5 - 320.0;
      const double dy = y + 0.5 - 240.0;
      const double vignetting = 1.0 - 0.2 * (dx * dx + dy * dy) / (320.0 * 320.0 + 240.0 * 240.0);
      sent += 2e-3 * 280.0 * 280.0 * vignetting * std::pow(1.0 + u * u + v * v, -1.5) /
              (p.lens.fx * p.lens.fy);
    }
  }
  const Image<float> e = irradiance_of(codes, kBlock, Face::kZMax, p);
  EXPECT_NEAR(power_on(e, 1), sent, 1e-4 * sent);
  EXPECT_EQ(power_on(e, 0), 0.0);
}

// Pixels are 0.09 mm: a region's edges lie within half of one, 0.09 of a cell, of where they were asked for, bent by the lens or not.
TEST(PerspectiveLight, AsksForRegionsThroughItsLens) {
  ProjectorCalibration p = projector_at({60.0, -40.0, 290.0});
  p.lens.distortion = {1.5, -2.0, 0.004, -0.003, 0.0};
  const auto set = make_patterns({4, 0}, kBlock, Face::kZMax, p);
  ASSERT_TRUE(set) << set.error().message;
  ASSERT_EQ(set->lights.size(), 16U);
  const Image<float> white =
      irradiance_of(Image<std::uint8_t>(640, 480, 3, 255), kBlock, Face::kZMax, p);
  Image<double> sum(48, 48, 1);
  for (int region = 0; region < 16; ++region) {
    const Image<float>& e = set->lights[static_cast<std::size_t>(region)].irradiance;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 48; ++x) {
        const double share = e.at(x, y, 0) / white.at(x, y, 0);
        sum.at(x, y) += share;
        const bool in = x / 12 == region % 4 && y / 12 == region / 4;
        const bool at_edge = x % 12 == 0 || x % 12 == 11 || y % 12 == 0 || y % 12 == 11;
        EXPECT_NEAR(share, in ? 1.0 : 0.0, at_edge ? 0.25 : 1e-6) << x << ", " << y;
      }
    }
  }
  // No pixel is asked for twice and none between two regions is left out.
  for (int y = 1; y < 47; ++y) {
    for (int x = 1; x < 47; ++x) EXPECT_NEAR(sum.at(x, y), 1.0, 1e-5) << x << ", " << y;
  }
}

TEST(PerspectiveLight, FromBehindTheSampleIsRefusedWithWhatToDo) {
  const auto set = make_patterns({4, 8}, kBlock, Face::kZMin, projector_at({12.0, 12.0, 300.0}));
  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message,
              HasSubstr("projector at (12.0, 12.0, 300.0) mm is not in front of face z_min"));
  EXPECT_THAT(set.error().message, HasSubstr("calibration.projector.kind = \"perpendicular\""));
}

TEST(PerspectiveLight, NamesTheRegionThatItsPictureDoesNotReach) {
  ProjectorCalibration p = projector_at({12.0, 12.0, 300.0});
  p.lens.cx = 120.0;
  const auto set = make_patterns({4, 8}, kBlock, Face::kZMax, p);
  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("region_0_"));
  EXPECT_THAT(set.error().message, HasSubstr("expected a lit face within its picture"));
}

}  // namespace
}  // namespace opaline::capture
