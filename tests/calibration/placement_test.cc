// A sample in its holder before the simulated camera, whose pose is known.

#include "calibration/placement.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>

#include "calibration/board_finder.h"
#include "sim/holder_optics.h"
#include "sim/sensor.h"
#include "tests/support/simulated_station.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

constexpr double kExposure = 1.0 / 30.0;
constexpr double kFace = 8.0;  // mm, of tests/support's block

/// That block in a holder of 10 x 10 squares about its seen face, 20 pixels a mm.
struct Held {
  sim::RigOptions rig = support::tiny_rig();
  sim::HolderScene scene;
  HolderOptions holder;

  Held() {
    CameraModel& lens = rig.camera.model;
    lens.width = lens.height = 400;
    lens.fx = lens.fy = 2000.0;
    lens.cx = 203.0;
    lens.cy = 198.0;
    lens.distortion = {-0.08, 0.02, 1e-4, -1e-4, 0.0};
    lens.camera_from_sample = look_at({4.6, 3.5, 104.0}, {4.3, 3.8, 4.0}, {0.2, 1.0, 0.0});
    scene.board.square_mm = 1.8;
    scene.board.marker_mm = 1.26;
    scene.board.margin_mm = 0.4;
    scene.sample_from_board = {{1, 0, 0, 0, -1, 0, 0, 0, -1}, {-5.0, 13.0, 4.0}};
    holder.board = {.kind = Board::Kind::kCharuco,
                    .squares_x = scene.board.squares_x,
                    .squares_y = scene.board.squares_y,
                    .square_mm = scene.board.square_mm,
                    .marker_mm = scene.board.marker_mm};
    holder.sample_from_board = scene.sample_from_board;
  }
  const Pose& truth() const { return rig.camera.model.camera_from_sample; }

  BoardView photographed() const {
    const sim::HolderOptics optics(rig.camera, rig.projector, support::tiny_responses(), scene);
    const Image<std::uint8_t> white(rig.projector.width, rig.projector.height, 3, 255);
    Image<float> light = optics.light(white).sensor_radiance;
    for (float& v : light.samples()) v *= static_cast<float>(kExposure);
    const auto codes = sim::Sensor(rig.camera, 1).read(light, kExposure, 1);
    return *find_board(grey_of(codes), holder.board, "holder");
  }
  /// The corners beside the sample where the truth has them, and noise.
  BoardView projected(double noise_px, std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    BoardView view;
    for (int id = 0; id < holder.board.corner_count(); ++id) {
      const Vec3 p = holder.sample_from_board.apply(holder.board.corner(id));
      if (p.x > 0.0 && p.y > 0.0 && p.x < kFace && p.y < kFace) continue;
      const auto pixel = rig.camera.model.project(p);
      const double x = pixel.x + noise_px * normal(random);
      view.corners.push_back({id, {x, pixel.y + noise_px * normal(random)}});
    }
    return view;
  }
  /// How far a point of the sample seems to be from where it is, across the line of sight, mm.
  double off_at(const Pose& pose, Vec3 point) const {
    const Vec3 was = truth().apply(point);
    const Vec3 off = pose.apply(point) - was;
    const Vec3 sight = normalized(was);
    return length(off - sight * dot(off, sight));
  }
};

// The worst corner's deviation is known, so four of it bound what the sample's corners inside may be off by. A hundredth of a mm is a
// fiftieth of the demo's cells.
TEST(PlaceSample, TheCameraStandsWhereThePictureOfItsHolderPutsIt) {
  const Held held;
  const BoardView view = held.photographed();
  ASSERT_EQ(view.fault, "");
  const auto found = place_sample(held.rig.camera.model, held.holder, view);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GE(found->corners, 24);
  EXPECT_LT(found->rms_px, 0.1);
  EXPECT_LT(found->deviation_mm, 0.01);
  for (const Vec3 corner :
       {Vec3{0, 0, 4}, Vec3{kFace, 0, 4}, Vec3{0, kFace, 4}, Vec3{kFace, kFace, 4}})
    EXPECT_LT(held.off_at(found->camera_from_sample, corner), 4.0 * found->deviation_mm);
}

TEST(PlaceSample, OfPerfectCornersThePoseIsExactWhateverTheLensBelievedOfItsPlace) {
  const Held held;
  CameraModel lens = held.rig.camera.model;
  lens.camera_from_sample = {};
  const auto found = place_sample(lens, held.holder, held.projected(0.0, 1));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(length(found->camera_from_sample.translation - held.truth().translation), 1e-6);
}

// m' C^-1 m of an error m of six normal numbers has mean 6 and deviation sqrt(12), but C rests on residuals of 2 n - 6 degrees of freedom,
// which makes it 6 (2 n - 6) / (2 n - 8); four deviations of the mean of 100.
TEST(PlaceSample, ItsCovarianceIsThatOfItsErrors) {
  const Held held;
  constexpr int kDraws = 100;
  double sum = 0.0;
  std::size_t corners = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const BoardView view = held.projected(0.05, static_cast<std::uint64_t>(draw));
    corners = view.corners.size();
    const auto found = place_sample(held.rig.camera.model, held.holder, view);
    ASSERT_TRUE(found) << found.error().message;
    const Pose turn = [&] {  // of what is seen
      Pose t;
      const Pose back = held.truth().inverse();
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          t.rotation[3 * i + j] = 0.0;
          for (std::size_t k = 0; k < 3; ++k)
            t.rotation[3 * i + j] +=
                found->camera_from_sample.rotation[3 * i + k] * back.rotation[3 * k + j];
        }
      }
      return t;
    }();
    const Vec3 moved = found->camera_from_sample.translation - held.truth().translation;
    Eigen::Matrix<double, 6, 1> m;
    m << turn.rotation[7], turn.rotation[2], turn.rotation[3], moved.x, moved.y, moved.z;
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(
        found->covariance.data());
    sum += m.dot(covariance.ldlt().solve(m)) / kDraws;
  }
  const double freedom = 2.0 * static_cast<double>(corners) - 6.0;
  EXPECT_NEAR(sum, 6.0 * freedom / (freedom - 2.0), 4.0 * std::sqrt(12.0 / kDraws));
}

TEST(PlaceSample, ACornerThatIsSomewhereElseDoesNotCount) {
  const Held held;
  BoardView view = held.projected(0.02, 3);
  view.corners[5].pixel.x += 2.0;
  const auto found = place_sample(held.rig.camera.model, held.holder, view);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->corners, static_cast<int>(view.corners.size()) - 1);
  EXPECT_LT(held.off_at(found->camera_from_sample, {4, 4, 4}), 4.0 * found->deviation_mm);
}

TEST(PlaceSample, ABentHolderOrAnotherIsRefusedAndSaysWhy) {
  const Held held;
  const auto bent = place_sample(held.rig.camera.model, held.holder, held.projected(1.0, 2));
  ASSERT_FALSE(bent);
  EXPECT_THAT(bent.error().message, HasSubstr("is [calibration.holder] of this holder"));
  BoardView few = held.projected(0.0, 1);
  few.corners.resize(7);
  const auto hidden = place_sample(held.rig.camera.model, held.holder, few);
  ASSERT_FALSE(hidden);
  EXPECT_THAT(hidden.error().message, HasSubstr("7 corners seen, 8 are needed"));
  BoardView none;
  none.fault = "no board found: hidden";
  const auto unseen = place_sample(held.rig.camera.model, held.holder, none);
  ASSERT_FALSE(unseen);
  EXPECT_THAT(unseen.error().message, HasSubstr("holder is not seen: no board found"));
}

TEST(PlaceSample, IsKeptOnDisk) {
  const Held held;
  const auto found = place_sample(held.rig.camera.model, held.holder, held.projected(0.02, 3));
  ASSERT_TRUE(found) << found.error().message;
  const auto back = placement_from_text(to_text(*found), "placement.json");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->camera_from_sample, found->camera_from_sample);
  EXPECT_EQ(back->covariance, found->covariance);
  EXPECT_EQ(back->corners, found->corners);
  const auto damaged = placement_from_text("{", "placement.json");
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message, HasSubstr("placement.json: damaged"));
}

// The holder shines by the light that falls beside the sample, and by no other.
TEST(HolderOptics, IsLitBesideTheSampleAlone) {
  const Held held;
  const auto responses = support::tiny_responses();
  const sim::HolderOptics optics(held.rig.camera, held.rig.projector, responses, held.scene);
  const sim::StationOptics alone(held.rig.camera, held.rig.projector, responses);
  Image<std::uint8_t> codes(held.rig.projector.width, held.rig.projector.height, 3);
  for (int y = 14; y < 44; ++y) {
    for (int x = 24; x < 54; ++x) {
      for (int c = 0; c < 3; ++c) codes.at(x, y, c) = 255;
    }
  }
  const auto with = optics.light(codes).sensor_radiance;
  const auto without = alone.light(codes).sensor_radiance;
  const auto corner = held.rig.camera.model.project(
      held.scene.sample_from_board.apply({2.7, 0.1, 0.0}));  // white, above a marker
  const auto x = static_cast<int>(corner.x);
  const auto y = static_cast<int>(corner.y);
  EXPECT_FLOAT_EQ(with.at(200, 200, 1), without.at(200, 200, 1));
  const auto white = optics.light(
      Image<std::uint8_t>(held.rig.projector.width, held.rig.projector.height, 3, 255));
  EXPECT_EQ(without.at(x, y, 1), 0.0f);
  // What leaks at code 0, a thousandth, is all it gets.
  EXPECT_NEAR(
      with.at(x, y, 1) / white.sensor_radiance.at(x, y, 1), held.rig.projector.black_level, 1e-6);
}

}  // namespace
}  // namespace opaline::calibration
